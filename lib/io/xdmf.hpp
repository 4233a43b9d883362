// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
// Private: what ParaView is told of a file of snapshots.
//
// ParaView has two readers of XDMF, and neither reads all of it. What both of ParaView 5.11 read:
//   - cells as quadrilaterals with their corners: of a rectilinear grid in a plane Xdmf3ReaderS takes the axes in the reverse
//     order, and of a structured one XDMFReader cannot read vectors at corners;
//   - points with a topology that lists them: without it Xdmf3ReaderS makes no cells, and shows nothing;
//   - vectors of three and tensors of nine components: Xdmf3ReaderS leaves two components two, which glyphs do not take, and the
//     readers disagree about the order of six;
//   - meshes beside each other as a spatial collection with the same fields: Xdmf3ReaderS takes them for pieces of one thing, and
//     leaves out what one of them lacks; of a tree it makes nothing.
#include <ductile/io/snapshot_index.hpp>

#include <cstddef>
#include <span>
#include <string>

namespace ductile::io {

/// The XDMF 3 description of snapshots of fields on cells_x x cells_y cells, in an HDF5 file (named relative to the XDMF file)
/// with the datasets grid/corners and grid/corners_of_cells: a temporal collection.
[[nodiscard]] std::string xdmf_of_cells(const std::string& hdf5_file, int cells_x, int cells_y,
                                        std::span<const StoredSnapshot> snapshots);

/// The same of snapshots of points. The first dataset of a snapshot is the place of those that all fields belong to; other places
/// are meshes of their own, whose fields are NaN.
[[nodiscard]] std::string xdmf_of_points(const std::string& hdf5_file, std::span<const StoredSnapshot> snapshots);

} // namespace ductile::io
