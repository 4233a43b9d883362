// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/io/array_view.hpp>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace ductile::io {

/// What happens to the values of a view on their way into a dataset: written = value * scale + offset.
struct Conversion {
    double scale = 1.0;
    double offset = 0.0;
    bool repeat_first_column = false; ///< the dataset gets one more column, a copy of the first (a periodic grid's image)
};

/// Throws InputError unless there is a regular file of this name.
void require_file(const std::filesystem::path& path);

/// An open HDF5 file; names are paths inside it ("grid/x_corner"), and groups on the way to a new dataset are made.
///
/// A failure becomes an exception that names file and object: InputError while reading (no such file, not HDF5, truncated,
/// missing, wrong type or shape), RunError while writing (full disk, lost folder). HDF5 itself prints nothing.
class Hdf5File {
public:
    /// Makes a new file; an earlier one of this name is lost.
    /// `user_block`: bytes left to the caller before HDF5's own: 0, or a power of 2 from 512 on.
    [[nodiscard]] static Hdf5File create(const std::filesystem::path& path, std::size_t user_block = 0);
    [[nodiscard]] static Hdf5File open(const std::filesystem::path& path);
    [[nodiscard]] static Hdf5File open_for_append(const std::filesystem::path& path);

    Hdf5File(Hdf5File&& other) noexcept;
    Hdf5File& operator=(Hdf5File&& other) noexcept;
    /// Closes without a word about failures: a writer that wants to know calls close() first.
    ~Hdf5File();

    /// Hands everything to the operating system and closes; a full disk often shows only here, as RunError.
    void close();

    void create_group(const std::string& name);
    [[nodiscard]] bool contains(const std::string& name) const;
    /// Names of what a group holds, in alphabetical order.
    [[nodiscard]] std::vector<std::string> members(const std::string& group) const;
    /// Hands what was written so far to the operating system.
    void flush();
    /// Where in the file the values of a dataset begin, once they are written and flushed; 0 for one without values.
    [[nodiscard]] std::uint64_t byte_offset(const std::string& name) const;

    void write(const std::string& name, const ArrayView& values, const Conversion& conversion = {});
    void write(const std::string& name, std::span<const double> values);
    void write(const std::string& name, std::span<const std::int64_t> values);
    /// A dataset without values of its own that shows others of this file as the components of a vector: component c, along a
    /// last extent of its own, is parts[c], of doubles and this shape; an empty name is zero.
    void write_view(const std::string& name, std::span<const std::string> parts, const std::vector<std::size_t>& shape);
    /// A second name of a dataset, which takes no room.
    void link(const std::string& name, const std::string& dataset);
    /// A dataset of doubles that are all the same: it takes no room.
    void write_constant(const std::string& name, double value, const std::vector<std::size_t>& shape);
    void write_bytes(const std::string& name, std::string_view bytes);
    void write(const std::string& name, const std::string& text);

    /// Fills the view; the dataset must have exactly its rows and columns.
    void read(const std::string& name, const MutableArrayView& values) const;
    [[nodiscard]] std::vector<double> read_doubles(const std::string& name) const;
    [[nodiscard]] std::vector<std::int64_t> read_integers(const std::string& name) const;
    [[nodiscard]] std::string read_text(const std::string& name) const;
    /// Extents of a dataset; empty for a single value.
    [[nodiscard]] std::vector<std::size_t> shape(const std::string& name) const;

    /// Attributes of a group or dataset ("/" is the file itself). An attribute of that name must not exist yet.
    void set_attribute(const std::string& object, const std::string& name, double value);
    void set_attribute(const std::string& object, const std::string& name, std::int64_t value);
    void set_attribute(const std::string& object, const std::string& name, const std::string& text);
    [[nodiscard]] bool has_attribute(const std::string& object, const std::string& name) const;
    [[nodiscard]] double double_attribute(const std::string& object, const std::string& name) const;
    [[nodiscard]] std::int64_t integer_attribute(const std::string& object, const std::string& name) const;
    [[nodiscard]] std::string text_attribute(const std::string& object, const std::string& name) const;

    [[nodiscard]] const std::filesystem::path& path() const { return path_; }

private:
    Hdf5File(std::filesystem::path path, std::int64_t id) : path_(std::move(path)), id_(id) {}

    std::filesystem::path path_;
    std::int64_t id_ = -1;
};

} // namespace ductile::io
