// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
// Private: helpers of the hdf5*.cpp files; no other file sees the HDF5 headers.
#include <ductile/base/error.hpp>

#include <fmt/format.h>
#include <hdf5.h>

#include <filesystem>
#include <string>

namespace ductile::io::hdf5 {

/// HDF5's own words for the deepest cause of the last failure; empty if it left none.
inline std::string cause() {
    std::string deepest;
    const auto keep_first = [](unsigned n, const H5E_error2_t* entry, void* out) -> herr_t {
        if (n == 0 && entry->desc)
            *static_cast<std::string*>(out) = entry->desc;
        return 0;
    };
    H5Ewalk2(H5E_DEFAULT, H5E_WALK_UPWARD, keep_first, &deepest);
    return deepest.empty() ? "" : " (" + deepest + ")";
}

[[noreturn]] inline void fail_to_write(const std::filesystem::path& path, const std::string& what) {
    throw RunError(fmt::format("{}: cannot write {}{}: check free space and whether the folder is still there", path.string(),
                               what, cause()));
}

[[noreturn]] inline void fail_to_read(const std::filesystem::path& path, const std::string& what) {
    throw InputError(fmt::format("{}: {}{}", path.string(), what, cause()));
}

/// Owns any HDF5 identifier; which function closes it follows from the kind of object.
class Id {
public:
    Id(hid_t id, herr_t (*close)(hid_t)) : id_(id), close_(close) {}
    ~Id() {
        if (id_ >= 0)
            close_(id_);
    }
    Id(const Id&) = delete;
    Id& operator=(const Id&) = delete;
    [[nodiscard]] bool valid() const { return id_ >= 0; }
    operator hid_t() const { return id_; }

private:
    hid_t id_;
    herr_t (*close_)(hid_t);
};

/// Strings of any length in UTF-8, which h5py gives back as str.
inline Id text_type() {
    const hid_t type = H5Tcopy(H5T_C_S1);
    H5Tset_size(type, H5T_VARIABLE);
    H5Tset_cset(type, H5T_CSET_UTF8);
    return {type, H5Tclose};
}

/// Takes over a string that HDF5 allocated.
inline std::string adopt(char* text) {
    std::string copy = text ? text : "";
    H5free_memory(text);
    return copy;
}

} // namespace ductile::io::hdf5
