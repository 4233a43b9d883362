#pragma once
#include <span>
#include <string>
#include <vector>

namespace ductile::io {

/// One field of a snapshot as ParaView sees it: its dataset is `group/name`.
struct XdmfField {
    std::string name;
    std::string units;
    bool at_cells = true; ///< otherwise at corners
};

struct XdmfSnapshot {
    std::string group = {};
    double time_s = 0.0;
    std::vector<XdmfField> fields = {};
};

/// The XDMF 3 description of snapshots in an HDF5 file (named relative to the XDMF file) with the datasets grid/x_corner and
/// grid/y_corner: a temporal collection of rectilinear grids.
[[nodiscard]] std::string xdmf_text(const std::string& hdf5_file, int cells_x, int cells_y,
                                    std::span<const XdmfSnapshot> snapshots);

} // namespace ductile::io
