// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/mpm/particles.hpp>

namespace ductile::mpm {

namespace {

template <class T> void gather(aligned_vector<T>& values, std::span<const std::int32_t> order, aligned_vector<T>& buffer) {
    buffer.resize(values.size());
    for (std::size_t n = 0; n < order.size(); ++n)
        buffer[n] = values[static_cast<std::size_t>(order[n])];
    values.swap(buffer);
}

} // namespace

void Particles::resize(std::size_t count) {
    for (const auto& [name, array] : named_arrays(*this))
        array->resize(count, 0.0);
    for (const auto& [name, array] : named_integer_arrays(*this))
        array->resize(count, 0);
}

void Particles::provide_internal(std::size_t variables) {
    while (internal.size() < variables)
        internal.emplace_back(size(), 0.0);
}

void Particles::provide_affine() {
    if (affine.empty())
        affine.assign(4, aligned_vector<double>(size(), 0.0));
}

void Particles::permute(std::span<const std::int32_t> order, PermutationBuffers& buffers) {
    for (const auto& [name, array] : common_arrays(*this))
        gather(*array, order, buffers.numbers);
    for (aligned_vector<double>& array : internal)
        gather(array, order, buffers.numbers);
    for (aligned_vector<double>& array : affine)
        gather(array, order, buffers.numbers);
    for (const auto& [name, array] : named_integer_arrays(*this))
        gather(*array, order, buffers.integers);
    if (surface.size() + loaded.size() == 0)
        return;
    buffers.integers.resize(order.size());
    for (std::size_t n = 0; n < order.size(); ++n)
        buffers.integers[static_cast<std::size_t>(order[n])] = static_cast<std::int64_t>(n);
    for (CarriedPoints* const points : {static_cast<CarriedPoints*>(&surface), static_cast<CarriedPoints*>(&loaded)})
        for (std::int64_t& particle : points->particle)
            particle = buffers.integers[static_cast<std::size_t>(particle)];
}

std::size_t Particles::memory_bytes() const {
    return size() * (sizeof(double) * named_arrays(*this).size() + sizeof(std::int64_t) * named_integer_arrays(*this).size());
}

} // namespace ductile::mpm
