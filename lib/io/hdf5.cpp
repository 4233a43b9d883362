// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/base/error.hpp>
#include <ductile/io/hdf5.hpp>
#include <ductile/io/hdf5_handle.hpp>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <type_traits>
#include <utility>

namespace ductile::io {
using namespace hdf5;
namespace {

static_assert(std::is_same_v<hid_t, std::int64_t>, "hdf5.hpp stores HDF5 identifiers as 64-bit integers");

/// Before the first use: HDF5 prints nothing, and does not try again at exit to write a file that could not be written
/// (it crashes there). Nothing is lost by that, because every file is closed by its owner.
/// Every way to an Hdf5File begins here: constants of HDF5 such as H5F_ACC_RDONLY open the library, too, and must come after it.
void set_up_library() {
    static const bool once = [] {
        H5dont_atexit(); // fails where somebody else has used the library already: nothing can be done then
        H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
        return true;
    }();
    static_cast<void>(once);
}

/// Files are not locked: someone who looks at the snapshots of a run must not stop it.
Id file_access() {
    const hid_t access = H5Pcreate(H5P_FILE_ACCESS);
    H5Pset_file_locking(access, false, true);
    return {access, H5Pclose};
}

hid_t open_file(const std::filesystem::path& path, bool for_append) {
    set_up_library();
    const unsigned mode = for_append ? H5F_ACC_RDWR : H5F_ACC_RDONLY;
    require_file(path);
    const hid_t id = H5Fopen(path.c_str(), mode, file_access());
    if (id >= 0)
        return id;
    if (H5Fis_hdf5(path.c_str()) == 0)
        throw InputError(fmt::format("{}: this is not an HDF5 file", path.string()));
    fail_to_read(path, "cannot open this HDF5 file, it may be truncated or damaged");
}

Id dataset_creation() {
    const hid_t creation = H5Pcreate(H5P_DATASET_CREATE);
    H5Pset_obj_track_times(creation, false); // the same content gives the same bytes
    return {creation, H5Pclose};
}

/// A new dataset in `file`; groups on the way are made.
Id make_dataset(hid_t file, const std::filesystem::path& path, const std::string& name, hid_t type, hid_t space,
                const Id& creation = dataset_creation()) {
    const Id links(H5Pcreate(H5P_LINK_CREATE), H5Pclose);
    H5Pset_create_intermediate_group(links, 1);
    const hid_t id = H5Dcreate2(file, name.c_str(), type, space, links, creation, H5P_DEFAULT);
    if (id < 0)
        fail_to_write(path, name);
    return {id, H5Dclose};
}

void write_vector(hid_t file, const std::filesystem::path& path, const std::string& name, hid_t type, const void* values,
                  std::size_t count) {
    const hsize_t extent = count;
    const Id space(H5Screate_simple(1, &extent, nullptr), H5Sclose);
    const Id data = make_dataset(file, path, name, type, space);
    if (count > 0 && H5Dwrite(data, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, values) < 0)
        fail_to_write(path, name);
}

/// Writes rows straight from the padded view: HDF5 picks the columns.
bool write_rows(hid_t data, const ArrayView& values) {
    const hsize_t memory[2] = {static_cast<hsize_t>(values.rows), static_cast<hsize_t>(values.stride)};
    const hsize_t start[2] = {0, 0}, count[2] = {memory[0], static_cast<hsize_t>(values.columns)};
    const Id space(H5Screate_simple(2, memory, nullptr), H5Sclose);
    H5Sselect_hyperslab(space, H5S_SELECT_SET, start, nullptr, count, nullptr);
    return H5Dwrite(data, H5T_NATIVE_DOUBLE, space, H5S_ALL, H5P_DEFAULT, values.first) >= 0;
}

/// Writes converted values through a buffer of some rows.
bool write_converted_rows(hid_t data, const ArrayView& values, const Conversion& how) {
    const int columns = values.columns + (how.repeat_first_column ? 1 : 0);
    const int batch = std::clamp((1 << 17) / columns, 1, values.rows);
    std::vector<double> buffer(static_cast<std::size_t>(batch) * static_cast<std::size_t>(columns));
    const Id file_space(H5Dget_space(data), H5Sclose);
    for (int begin = 0; begin < values.rows; begin += batch) {
        const int rows = std::min(batch, values.rows - begin);
        double* out = buffer.data();
        for (int j = begin; j < begin + rows; ++j) {
            const double* in = values.row(j);
            for (int i = 0; i < values.columns; ++i)
                *out++ = in[i] * how.scale + how.offset;
            if (how.repeat_first_column)
                *out++ = in[0] * how.scale + how.offset;
        }
        const hsize_t start[2] = {static_cast<hsize_t>(begin), 0};
        const hsize_t count[2] = {static_cast<hsize_t>(rows), static_cast<hsize_t>(columns)};
        const Id memory(H5Screate_simple(2, count, nullptr), H5Sclose);
        H5Sselect_hyperslab(file_space, H5S_SELECT_SET, start, nullptr, count, nullptr);
        if (H5Dwrite(data, H5T_NATIVE_DOUBLE, memory, file_space, H5P_DEFAULT, buffer.data()) < 0)
            return false;
    }
    return true;
}

Id open_dataset(hid_t file, const std::filesystem::path& path, const std::string& name) {
    if (H5Oexists_by_name(file, name.c_str(), H5P_DEFAULT) <= 0) {
        H5Eclear2(H5E_DEFAULT);
        fail_to_read(path, fmt::format("'{}' is missing", name));
    }
    const hid_t id = H5Dopen2(file, name.c_str(), H5P_DEFAULT);
    if (id < 0)
        fail_to_read(path, fmt::format("cannot open '{}' as a dataset", name));
    return {id, H5Dclose};
}

/// Throws InputError where the file cannot hold so many values: nobody takes memory on the word of a damaged file.
std::vector<std::size_t> extents(hid_t data, const std::filesystem::path& path, const std::string& name) {
    const Id space(H5Dget_space(data), H5Sclose), type(H5Dget_type(data), H5Tclose);
    std::vector<hsize_t> found(static_cast<std::size_t>(std::max(0, H5Sget_simple_extent_ndims(space))));
    if (!found.empty())
        H5Sget_simple_extent_dims(space, found.data(), nullptr);
    constexpr double densest = 1100.0; // compression: deflate comes to 1032 at most
    double bytes = static_cast<double>(H5Tget_size(type));
    for (const hsize_t extent : found)
        bytes *= static_cast<double>(extent);
    if (bytes > densest * static_cast<double>(H5Dget_storage_size(data)))
        throw InputError(fmt::format("{}: '{}' claims {} values, more than are stored: it is damaged", path.string(), name,
                                     fmt::join(found, " x ")));
    return {found.begin(), found.end()};
}

template <class T>
std::vector<T> read_vector(hid_t file, const std::filesystem::path& path, const std::string& name, hid_t type) {
    const Id data = open_dataset(file, path, name);
    const std::vector<std::size_t> found = extents(data, path, name);
    if (found.size() != 1)
        throw InputError(fmt::format("{}: '{}' has {} dimensions, expected 1", path.string(), name, found.size()));
    std::vector<T> values(found[0]);
    if (!values.empty() && H5Dread(data, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()) < 0)
        fail_to_read(path, fmt::format("cannot read '{}'", name));
    return values;
}

} // namespace

void require_file(const std::filesystem::path& path) {
    std::error_code ignored;
    if (!std::filesystem::exists(path, ignored))
        throw InputError(fmt::format("{}: there is no such file", path.string()));
    if (!std::filesystem::is_regular_file(path, ignored))
        throw InputError(fmt::format("{}: this is not a file", path.string()));
}

Hdf5File Hdf5File::create(const std::filesystem::path& path, std::size_t user_block) {
    set_up_library();
    const Id creation(H5Pcreate(H5P_FILE_CREATE), H5Pclose);
    H5Pset_userblock(creation, user_block);
    const hid_t id = H5Fcreate(path.c_str(), H5F_ACC_TRUNC, creation, file_access());
    if (id < 0)
        fail_to_write(path, "a new file");
    return {path, id};
}

Hdf5File Hdf5File::open(const std::filesystem::path& path) { return {path, open_file(path, false)}; }
Hdf5File Hdf5File::open_for_append(const std::filesystem::path& path) { return {path, open_file(path, true)}; }

Hdf5File::Hdf5File(Hdf5File&& other) noexcept : path_(std::move(other.path_)), id_(std::exchange(other.id_, -1)) {}

Hdf5File& Hdf5File::operator=(Hdf5File&& other) noexcept {
    std::swap(path_, other.path_);
    std::swap(id_, other.id_);
    return *this;
}

Hdf5File::~Hdf5File() {
    if (id_ >= 0)
        H5Fclose(id_);
}

void Hdf5File::close() {
    const hid_t id = std::exchange(id_, -1);
    const bool flushed = H5Fflush(id, H5F_SCOPE_GLOBAL) >= 0;
    const std::string why = flushed ? "" : cause();
    if (H5Fclose(id) < 0 || !flushed)
        throw RunError(fmt::format("{}: cannot write the file{}: check free space", path_.string(), flushed ? cause() : why));
}

void Hdf5File::create_group(const std::string& name) {
    const Id links(H5Pcreate(H5P_LINK_CREATE), H5Pclose);
    H5Pset_create_intermediate_group(links, 1);
    const Id group(H5Gcreate2(id_, name.c_str(), links, H5P_DEFAULT, H5P_DEFAULT), H5Gclose);
    if (!group.valid())
        fail_to_write(path_, fmt::format("group '{}'", name));
}

bool Hdf5File::contains(const std::string& name) const {
    const htri_t found = H5Oexists_by_name(id_, name.c_str(), H5P_DEFAULT);
    H5Eclear2(H5E_DEFAULT);
    return found > 0;
}

std::vector<std::string> Hdf5File::members(const std::string& group) const {
    const Id opened(H5Gopen2(id_, group.c_str(), H5P_DEFAULT), H5Gclose);
    if (!opened.valid())
        fail_to_read(path_, fmt::format("group '{}' is missing", group));
    std::vector<std::string> names;
    const auto collect = [](hid_t, const char* name, const H5L_info_t*, void* out) -> herr_t {
        static_cast<std::vector<std::string>*>(out)->emplace_back(name);
        return 0;
    };
    if (H5Literate(opened, H5_INDEX_NAME, H5_ITER_INC, nullptr, collect, &names) < 0)
        fail_to_read(path_, fmt::format("cannot list group '{}', the file may be damaged", group));
    return names;
}

void Hdf5File::flush() {
    if (H5Fflush(id_, H5F_SCOPE_GLOBAL) < 0)
        fail_to_write(path_, "the file");
}

std::uint64_t Hdf5File::byte_offset(const std::string& name) const {
    const haddr_t offset = H5Dget_offset(open_dataset(id_, path_, name));
    return offset == HADDR_UNDEF ? 0 : offset;
}

void Hdf5File::write(const std::string& name, const ArrayView& values, const Conversion& conversion) {
    const hsize_t count[2] = {static_cast<hsize_t>(values.rows),
                              static_cast<hsize_t>(values.columns + (conversion.repeat_first_column ? 1 : 0))};
    const Id space(H5Screate_simple(2, count, nullptr), H5Sclose);
    const Id data = make_dataset(id_, path_, name, H5T_NATIVE_DOUBLE, space);
    if (values.rows == 0 || values.columns == 0)
        return;
    const bool plain = conversion.scale == 1.0 && conversion.offset == 0.0 && !conversion.repeat_first_column;
    if (!(plain ? write_rows(data, values) : write_converted_rows(data, values, conversion)))
        fail_to_write(path_, name);
}

void Hdf5File::write(const std::string& name, std::span<const double> values) {
    write_vector(id_, path_, name, H5T_NATIVE_DOUBLE, values.data(), values.size());
}

void Hdf5File::write(const std::string& name, std::span<const std::int64_t> values) {
    write_vector(id_, path_, name, H5T_NATIVE_INT64, values.data(), values.size());
}

void Hdf5File::write_view(const std::string& name, std::span<const std::string> parts, const std::vector<std::size_t>& shape) {
    const std::vector<hsize_t> part_extents(shape.begin(), shape.end());
    std::vector<hsize_t> extents = part_extents, start(shape.size() + 1, 0), count = part_extents;
    extents.push_back(parts.size());
    count.push_back(1);
    const Id part_space(H5Screate_simple(static_cast<int>(shape.size()), part_extents.data(), nullptr), H5Sclose);
    const Id space(H5Screate_simple(static_cast<int>(extents.size()), extents.data(), nullptr), H5Sclose);
    const Id creation = dataset_creation();
    for (std::size_t c = 0; c < parts.size(); ++c) {
        if (parts[c].empty())
            continue;
        start.back() = c;
        H5Sselect_hyperslab(space, H5S_SELECT_SET, start.data(), nullptr, count.data(), nullptr);
        if (H5Pset_virtual(creation, space, ".", ("/" + parts[c]).c_str(), part_space) < 0)
            fail_to_write(path_, name);
    }
    H5Sselect_all(space);
    make_dataset(id_, path_, name, H5T_NATIVE_DOUBLE, space, creation);
}

void Hdf5File::link(const std::string& name, const std::string& dataset) {
    if (H5Lcreate_hard(id_, dataset.c_str(), id_, name.c_str(), H5P_DEFAULT, H5P_DEFAULT) < 0)
        fail_to_write(path_, name);
}

void Hdf5File::write_constant(const std::string& name, double value, const std::vector<std::size_t>& shape) {
    const std::vector<hsize_t> extents(shape.begin(), shape.end());
    const Id space(H5Screate_simple(static_cast<int>(extents.size()), extents.data(), nullptr), H5Sclose);
    const Id creation = dataset_creation();
    H5Pset_fill_value(creation, H5T_NATIVE_DOUBLE, &value);
    make_dataset(id_, path_, name, H5T_NATIVE_DOUBLE, space, creation);
}

void Hdf5File::write_bytes(const std::string& name, std::string_view bytes) {
    write_vector(id_, path_, name, H5T_NATIVE_UINT8, bytes.data(), bytes.size());
}

void Hdf5File::write(const std::string& name, const std::string& text) {
    const Id space(H5Screate(H5S_SCALAR), H5Sclose);
    const Id type = text_type();
    const Id data = make_dataset(id_, path_, name, type, space);
    const char* first = text.c_str();
    if (H5Dwrite(data, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, &first) < 0)
        fail_to_write(path_, name);
}

void Hdf5File::read(const std::string& name, const MutableArrayView& values) const {
    const Id data = open_dataset(id_, path_, name);
    const std::vector<std::size_t> found = extents(data, path_, name);
    const std::vector<std::size_t> wanted = {static_cast<std::size_t>(values.rows), static_cast<std::size_t>(values.columns)};
    if (found != wanted)
        throw InputError(fmt::format("{}: '{}' is {} values, expected {} (rows x columns)", path_.string(), name,
                                     fmt::join(found, " x "), fmt::join(wanted, " x ")));
    if (values.rows == 0 || values.columns == 0)
        return;
    const hsize_t memory[2] = {wanted[0], static_cast<hsize_t>(values.stride)};
    const hsize_t start[2] = {0, 0}, count[2] = {wanted[0], wanted[1]};
    const Id space(H5Screate_simple(2, memory, nullptr), H5Sclose);
    H5Sselect_hyperslab(space, H5S_SELECT_SET, start, nullptr, count, nullptr);
    if (H5Dread(data, H5T_NATIVE_DOUBLE, space, H5S_ALL, H5P_DEFAULT, values.first) < 0)
        fail_to_read(path_, fmt::format("cannot read '{}'", name));
}

std::vector<double> Hdf5File::read_doubles(const std::string& name) const {
    return read_vector<double>(id_, path_, name, H5T_NATIVE_DOUBLE);
}

std::vector<std::int64_t> Hdf5File::read_integers(const std::string& name) const {
    return read_vector<std::int64_t>(id_, path_, name, H5T_NATIVE_INT64);
}

std::string Hdf5File::read_text(const std::string& name) const {
    const Id data = open_dataset(id_, path_, name);
    const Id type = text_type();
    char* text = nullptr;
    if (!extents(data, path_, name).empty() || H5Dread(data, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, &text) < 0)
        fail_to_read(path_, fmt::format("cannot read '{}' as text", name));
    return adopt(text);
}

std::vector<std::size_t> Hdf5File::shape(const std::string& name) const {
    return extents(open_dataset(id_, path_, name), path_, name);
}

} // namespace ductile::io
