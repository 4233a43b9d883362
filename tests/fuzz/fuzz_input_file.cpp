// SPDX-License-Identifier: GPL-3.0-or-later
// Files that options and scenes name: `--initial-file` of the grid and `particles` of a body. Each either is taken, and the run
// comes to its first step, or is refused with an InputError that has a message, before anything is written.
//
// The first byte picks the reader and the format. A CSV file is the rest of the input as it is. An HDF5 file is made of it,
// because the robustness of the HDF5 library is not the matter here: datasets with known and unknown names, of any number, shape,
// type and values.
#include "calls.hpp"

#include <fuzzer/FuzzedDataProvider.h>
#include <hdf5.h>

#include <array>
#include <cstdint>

using namespace ductile::fuzz;

namespace {

constexpr std::string_view grid = R"(carrier = "grid"
cells = "5x4"
initial = "file"
)";
constexpr std::string_view points = R"(carrier = "points"
cell-size = 1e-3
duration = 1e-3
[grid]
width = 0.005
height = 0.004
[materials.steel]
law = "von-mises"
young-modulus = 200e9
poisson-ratio = 0.3
density = 7800
yield-stress = 0.7e9
[[bodies]]
material = "steel"
)";

void make_hdf5(const std::filesystem::path& path, FuzzedDataProvider& input) {
    constexpr std::array names{
        "x",         "y",         "volume",    "velocity_x",     "velocity_y", "stress_xx",
        "stress_yy", "stress_zz", "stress_xy", "internal",       "pressure",   "effective_temperature",
        "s",         "tau",       "q",         "plastic_strain", "snapshots",  "snapshots/0000/effective_temperature"};
    constexpr std::array<hsize_t, 8> extents{0, 1, 2, 3, 4, 5, hsize_t{1} << 31, hsize_t{1} << 40};
    const std::array types{H5T_NATIVE_DOUBLE, H5T_NATIVE_FLOAT, H5T_NATIVE_INT8, H5T_C_S1};
    const hid_t file = H5Fcreate(path.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
    const hid_t links = H5Pcreate(H5P_LINK_CREATE);
    H5Pset_create_intermediate_group(links, 1);
    while (input.remaining_bytes() > 0) {
        std::vector<hsize_t> shape;
        const char* const name = input.PickValueInArray(names);
        for (int rank = input.ConsumeIntegralInRange(0, 3); rank > 0; --rank)
            shape.push_back(input.PickValueInArray(extents));
        const hid_t space = H5Screate_simple(static_cast<int>(shape.size()), shape.data(), nullptr);
        const hid_t creation = H5Pcreate(H5P_DATASET_CREATE);
        if (!shape.empty())
            H5Pset_chunk(creation, static_cast<int>(shape.size()), std::vector<hsize_t>(shape.size(), 4).data());
        const hid_t data = H5Dcreate2(file, name, types[input.ConsumeIntegralInRange<std::size_t>(0, types.size() - 1)], space,
                                      links, creation, H5P_DEFAULT);
        double count = 1.0;
        for (const hsize_t extent : shape)
            count *= static_cast<double>(extent);
        if (data >= 0 && count > 0.0 && count <= 1000.0 && input.ConsumeBool()) {
            std::vector<double> values(static_cast<std::size_t>(count));
            for (std::size_t k = 0; k < values.size() && input.remaining_bytes() > 0; ++k)
                values[k] = input.ConsumeBool() ? input.ConsumeFloatingPoint<double>()
                                                : 1e-4 * input.ConsumeIntegralInRange(-100, 6'500'000);
            H5Dwrite(data, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data());
        }
        H5Dclose(data);
        H5Pclose(creation);
        H5Sclose(space);
    }
    H5Pclose(links);
    H5Fclose(file);
}

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    static const Folder folder;
    if (size == 0)
        return -1;
    const bool of_grid = data[0] % 2 == 0, hdf5 = data[0] % 4 >= 2;
    const std::string name = hdf5 ? "input.h5" : "input.csv";
    if (hdf5) {
        FuzzedDataProvider input(data + 1, size - 1);
        make_hdf5(folder / name, input);
    } else {
        write(folder / name, {reinterpret_cast<const char*>(data + 1), size - 1});
    }
    const std::string text = of_grid ? std::string(grid) + "initial-file = \"" + name + "\"\n"
                                     : std::string(points) + "particles = \"" + name + "\"\n";
    write(folder / "scene.toml", text);
    call(program_named("scene"), {"scene", folder / "scene.toml"}, folder / "out");
    return 0;
}
