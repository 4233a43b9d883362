// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/mpm/observation.hpp>

#include <cstddef>

namespace ductile::mpm {

void TrailingMean::add(Tally& tally, double time, double value) const {
    std::vector<double>& samples = tally[name_];
    samples.insert(samples.end(), {time, value});
    if (samples.size() % 2048 != 0) // now and then, so that it costs little
        return;
    std::size_t old = 0;
    while (old + 2 < samples.size() && samples[old] < from_ * time)
        old += 2;
    samples.erase(samples.begin(), samples.begin() + static_cast<std::ptrdiff_t>(old));
}

double TrailingMean::mean(const Tally& tally) const {
    const std::vector<double>& samples = tally.at(name_);
    double sum = 0.0, count = 0.0;
    for (std::size_t k = 0; k + 1 < samples.size(); k += 2)
        if (samples[k] >= from_ * samples[samples.size() - 2]) {
            sum += samples[k + 1];
            count += 1.0;
        }
    return sum / count;
}

} // namespace ductile::mpm
