// SPDX-License-Identifier: GPL-3.0-or-later
// Any text as a scene file: `scene FILE` either takes it and comes to its first step, or refuses it with an InputError that has a
// message, before it writes anything. Both carriers, and grid scenes on points. Files that a scene may name lie beside it:
// particles.csv and fields.csv.
#include "calls.hpp"

#include <cstdint>

using namespace ductile::fuzz;

namespace {

/// Four cells of the domain of shear_band, and four particles in a square millimetre.
constexpr std::string_view fields = "x,y,effective_temperature\n"
                                    "-0.005,-0.005,640\n0.005,-0.005,650\n-0.005,0.005,660\n0.005,0.005,670\n";
constexpr std::string_view particles = "x,y,volume,velocity_x,stress_yy\n"
                                       "2.5e-4,2.5e-4,2.5e-7,0,0\n7.5e-4,2.5e-4,2.5e-7,0,1e6\n"
                                       "2.5e-4,7.5e-4,2.5e-7,1,0\n7.5e-4,7.5e-4,2.5e-7,1,1e6\n";

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    static const Folder folder;
    static const bool prepared = (write(folder / "fields.csv", fields), write(folder / "particles.csv", particles), true);
    static_cast<void>(prepared);
    write(folder / "scene.toml", {reinterpret_cast<const char*>(data), size});
    call(program_named("scene"), {"scene", folder / "scene.toml"}, folder / "out");
    return 0;
}
