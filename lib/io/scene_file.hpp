// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <filesystem>
#include <string>
#include <vector>

namespace ductile::io {

/// What a program that runs scene files must know before it declares options.
struct SceneCall {
    std::filesystem::path file;         ///< empty: the scene of the checkpoint
    std::string carrier;                ///< "grid" or "points"
    bool has_tables = false;            ///< a scene of points without is the grid's
    std::vector<const char*> arguments; ///< of the command line, without the file
};

/// From a command line `scene [FILE] [--key value ...]`. Throws InputError when there is neither a file nor a checkpoint to go on
/// from, or the file has no carrier, naming the file, and what is allowed. --help and --version do without both.
[[nodiscard]] SceneCall scene_call(int argc, const char* const* argv);

} // namespace ductile::io
