// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/io/hdf5.hpp>
#include <ductile/io/hdf5_handle.hpp>

namespace ductile::io {
using namespace hdf5;
namespace {

void write_attribute(hid_t file, const std::filesystem::path& path, const std::string& object, const std::string& name,
                     hid_t type, const void* value) {
    const Id space(H5Screate(H5S_SCALAR), H5Sclose);
    const Id attribute(H5Acreate_by_name(file, object.c_str(), name.c_str(), type, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT),
                       H5Aclose);
    if (!attribute.valid() || H5Awrite(attribute, type, value) < 0)
        fail_to_write(path, fmt::format("attribute '{}' of '{}'", name, object));
}

void read_attribute(hid_t file, const std::filesystem::path& path, const std::string& object, const std::string& name, hid_t type,
                    void* value) {
    if (H5Aexists_by_name(file, object.c_str(), name.c_str(), H5P_DEFAULT) <= 0) {
        H5Eclear2(H5E_DEFAULT);
        fail_to_read(path, fmt::format("attribute '{}' of '{}' is missing", name, object));
    }
    const Id attribute(H5Aopen_by_name(file, object.c_str(), name.c_str(), H5P_DEFAULT, H5P_DEFAULT), H5Aclose);
    if (attribute.valid() && H5Sget_simple_extent_npoints(Id(H5Aget_space(attribute), H5Sclose)) != 1)
        fail_to_read(path, fmt::format("attribute '{}' of '{}' is not one value", name, object));
    if (!attribute.valid() || H5Aread(attribute, type, value) < 0)
        fail_to_read(path, fmt::format("cannot read attribute '{}' of '{}'", name, object));
}

} // namespace

void Hdf5File::set_attribute(const std::string& object, const std::string& name, double value) {
    write_attribute(id_, path_, object, name, H5T_NATIVE_DOUBLE, &value);
}

void Hdf5File::set_attribute(const std::string& object, const std::string& name, std::int64_t value) {
    write_attribute(id_, path_, object, name, H5T_NATIVE_INT64, &value);
}

void Hdf5File::set_attribute(const std::string& object, const std::string& name, const std::string& text) {
    const char* first = text.c_str();
    write_attribute(id_, path_, object, name, text_type(), &first);
}

bool Hdf5File::has_attribute(const std::string& object, const std::string& name) const {
    const htri_t found = H5Aexists_by_name(id_, object.c_str(), name.c_str(), H5P_DEFAULT);
    H5Eclear2(H5E_DEFAULT);
    return found > 0;
}

double Hdf5File::double_attribute(const std::string& object, const std::string& name) const {
    double value = 0.0;
    read_attribute(id_, path_, object, name, H5T_NATIVE_DOUBLE, &value);
    return value;
}

std::int64_t Hdf5File::integer_attribute(const std::string& object, const std::string& name) const {
    std::int64_t value = 0;
    read_attribute(id_, path_, object, name, H5T_NATIVE_INT64, &value);
    return value;
}

std::string Hdf5File::text_attribute(const std::string& object, const std::string& name) const {
    char* text = nullptr;
    read_attribute(id_, path_, object, name, text_type(), &text);
    return adopt(text);
}

} // namespace ductile::io
