// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

/// What the fuzz targets share: a program is called as a function, and runs to where its first step would begin.
///
/// Everything of a program takes part but for three functions of the library, which calls.cpp defines anew: an interrupt is there
/// before the first step, so that a run writes all its files and ends; signals are left to libFuzzer; and the machine has 64 MB
/// of memory, so that larger scenes must be refused.
namespace ductile::fuzz {

/// A folder in memory; a process that ends by a signal or by libFuzzer leaves it behind.
class Folder {
public:
    Folder();
    ~Folder();
    Folder(const Folder&) = delete;
    Folder& operator=(const Folder&) = delete;
    std::filesystem::path operator/(const std::string& name) const { return path_ / name; }

private:
    std::filesystem::path path_;
};

using Program = int (*)(int, char**);
/// The main function of a program, or null.
[[nodiscard]] Program program_named(std::string_view name);

void write(const std::filesystem::path& path, std::string_view bytes);

/// The next call is interrupted when it asks for the so-and-so-many-th time after this whether it is, which it does once a step;
/// 0, as at the start: at once.
void interrupt_after(int questions);

enum class Keep { nothing, files };
/// Calls it with these words and with the folder `output` for the files, which is removed afterwards unless it is kept. Aborts,
/// saying why, when a promise is broken: an exception that is no Error, an error without a message, or, of a run that goes on
/// from no checkpoint, wrong input that is noticed after something was written.
void call(Program program, std::vector<std::string> words, const std::filesystem::path& output, Keep keep = Keep::nothing);

} // namespace ductile::fuzz
