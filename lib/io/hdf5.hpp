#pragma once
#include <ductile/io/array_view.hpp>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

namespace ductile::io {

/// What happens to the values of a view on their way into a dataset: written = value * scale + offset.
struct Conversion {
    double scale = 1.0;
    double offset = 0.0;
    bool repeat_first_column = false; ///< the dataset gets one more column, a copy of the first (a periodic grid's image)
};

/// An open HDF5 file; names are paths inside it ("grid/x_corner"), and groups on the way to a new dataset are made.
///
/// A failure becomes an exception that names file and object: InputError while reading (no such file, not HDF5, truncated,
/// missing, wrong type or shape), RunError while writing (full disk, lost folder). HDF5 itself prints nothing.
class Hdf5File {
public:
    /// Makes a new file; an earlier one of this name is lost.
    [[nodiscard]] static Hdf5File create(const std::filesystem::path& path);
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
    /// Copies a group or dataset, with everything below it, under the same name.
    void copy_from(const Hdf5File& source, const std::string& name);

    void write(const std::string& name, const ArrayView& values, const Conversion& conversion = {});
    void write(const std::string& name, std::span<const double> values);
    void write(const std::string& name, std::span<const std::int64_t> values);
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
