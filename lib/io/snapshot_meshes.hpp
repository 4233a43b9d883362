// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
// Private: what programs that draw snapshots need beside the numbers, made from the description of a snapshot alone, so that a
// continued file has the same.
#include <ductile/io/snapshot_index.hpp>

#include <cstddef>
#include <string>
#include <vector>

namespace ductile::io {

/// A vector or tensor, whose components are datasets of the snapshot.
struct CompositeField {
    std::string name = {};                 ///< that of its components, without _x or _xx
    std::vector<std::string> parts = {};   ///< the dataset of each component, 3 or 9, those of a tensor by rows; empty: zero
    const SnapshotDataset* like = nullptr; ///< a component: units, centring and, without the components, shape
};

/// All that the snapshot has components of: a_x and a_y are those of a vector, a_xx, a_yy, a_zz and a_xy those of a symmetric
/// tensor.
[[nodiscard]] std::vector<CompositeField> composites_of(const StoredSnapshot& snapshot);

/// Where it lies in the file: a view, without values of its own. Programs with HDF5 1.8 cannot read it, but all else.
[[nodiscard]] std::string view_path(const StoredSnapshot& snapshot, const CompositeField& field);

/// Whether a dataset holds places (x, y), a row each, of points.
[[nodiscard]] bool is_point_set(const SnapshotDataset& dataset);
/// The dataset with the numbers 0, 1, ... of so many points.
[[nodiscard]] std::string vertices_path(std::size_t points);

/// A field of so many points that have none: NaN.
[[nodiscard]] std::string no_field_path(std::size_t points, std::size_t components);

} // namespace ductile::io
