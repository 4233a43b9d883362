// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/io/array_view.hpp>
#include <ductile/io/hdf5.hpp>

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace ductile::io {

/// The rectangle that snapshots are drawn on: cells_x x cells_y cells; corner (0, 0) lies at (left_m, bottom_m). Columns are of
/// equal width, rows of equal height unless it is said where they lie.
struct SnapshotGrid {
    int cells_x = 0;
    int cells_y = 0;
    double width_m = 0.0;
    double height_m = 0.0;
    double left_m = 0.0;
    double bottom_m = 0.0;
    std::vector<double> y_corner_m = {}; ///< [cells_y + 1], or empty
    std::vector<double> y_centre_m = {}; ///< [cells_y] of the points between them that values are taken at, or empty
};

enum class Centring { cell, corner };

/// One field of a snapshot; the file holds values * scale + offset in the stated SI units.
/// Shape of the view: cells_y x cells_x at cells; (cells_y + 1) x (cells_x + 1) at corners, or one column less on a grid that
/// is periodic in x: the writer then repeats the first column.
struct SnapshotField {
    std::string name = {};
    std::string units = {};
    Centring centring = Centring::cell;
    ArrayView values = {};
    double scale = 1.0;
    double offset = 0.0;
    std::string same_as = {}; ///< an earlier field with these values, units and centring, of which the file gets a second name
};

/// Numbers that describe the whole file, written as attributes of its root; names carry units ("time_unit_s").
using SnapshotConstants = std::vector<std::pair<std::string, double>>;

/// Snapshots a continued run starts with: those of an earlier fields.h5 (or of its .partial form, which goes first) up to a time.
struct EarlierSnapshots {
    std::filesystem::path fields; ///< the earlier run's fields.h5
    double until_s = 0.0;         ///< time of the checkpoint; later snapshots are left out
    std::size_t count = 0;        ///< how many there were then
};

/// Whether a snapshot is wanted at this time, and the newest there is is older. Times are equal to a part in 10^9.
[[nodiscard]] bool lacks(const std::vector<double>& present, const std::vector<double>& wanted, double time_s);

class SnapshotFile;

/// The snapshots of a run, `fields.h5` and, for ParaView, `fields.xdmf` beside it, but for what a snapshot consists of.
///
/// While running the file is `fields.h5.partial`; it is complete and closed between two snapshots, so that others may read it
/// and a killed run leaves it behind. finish() (or the destructor) gives it its final name.
class Snapshots {
public:
    ~Snapshots();
    Snapshots(const Snapshots&) = delete;
    Snapshots& operator=(const Snapshots&) = delete;

    /// Renames to the final name and points the XDMF file there. Harmless when repeated.
    void finish();
    /// Times of the snapshots in the file, earlier ones included [s].
    [[nodiscard]] std::vector<double> times() const;
    /// What a person must know about the earlier snapshots; empty if nothing.
    [[nodiscard]] const std::string& warning() const;

protected:
    explicit Snapshots(std::unique_ptr<SnapshotFile> file);
    [[nodiscard]] SnapshotFile& file() { return *file_; }

private:
    std::unique_ptr<SnapshotFile> file_;
};

/// Snapshots of fields on a grid: "ductile fields 1".
class SnapshotWriter final : public Snapshots {
public:
    /// Throws RunError when the file cannot be made, InputError when the earlier snapshots are damaged or on another grid.
    SnapshotWriter(std::filesystem::path fields, const std::string& program, const SnapshotGrid& grid,
                   const std::optional<EarlierSnapshots>& earlier = {}, const SnapshotConstants& constants = {});

    /// Adds a snapshot. Space is reserved first: a full disk is a RunError that says how much is missing, and the
    /// snapshots before stay intact.
    void write(double time_s, std::int64_t step, std::span<const SnapshotField> fields);

private:
    SnapshotGrid grid_;
};

} // namespace ductile::io
