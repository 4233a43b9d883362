// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <doctest/doctest.h>
#include <filesystem>
#include <functional>
#include <hdf5.h>
#include <numeric>
#include <string>
#include <vector>

namespace scratch {

/// A dataset as any other program reads it.
struct Values {
    std::vector<hsize_t> shape = {};
    std::vector<double> values = {};
};

inline Values values_of(const std::filesystem::path& path, const std::string& name) {
    const hid_t file = H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT);
    REQUIRE(file >= 0);
    const hid_t data = H5Dopen2(file, name.c_str(), H5P_DEFAULT), space = H5Dget_space(data);
    Values read;
    read.shape.resize(static_cast<std::size_t>(H5Sget_simple_extent_ndims(space)));
    H5Sget_simple_extent_dims(space, read.shape.data(), nullptr);
    read.values.resize(std::accumulate(read.shape.begin(), read.shape.end(), std::size_t{1}, std::multiplies<>()));
    CHECK(H5Dread(data, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, read.values.data()) >= 0);
    H5Sclose(space);
    H5Dclose(data);
    H5Fclose(file);
    return read;
}

} // namespace scratch
