// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/base/error.hpp>
#include <ductile/io/checksum.hpp>

#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <string>
#include <vector>

namespace fs = std::filesystem;

namespace ductile::io {
namespace {

std::string seal_line(std::uint64_t bytes, std::uint32_t sum) {
    return fmt::format("\nductile: {:016x} bytes before this line, CRC-32 {:08x}\n", bytes, sum);
}

} // namespace

void Checksum::add(std::string_view bytes) {
    value_ = static_cast<std::uint32_t>(crc32_z(value_, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
}

std::uint32_t checksum(std::string_view bytes) {
    Checksum sum;
    sum.add(bytes);
    return sum.value();
}

std::uint32_t checksum(const fs::path& path, std::uint64_t offset, std::uint64_t bytes) {
    std::ifstream file(path, std::ios::binary);
    file.seekg(static_cast<std::streamoff>(offset));
    std::vector<char> buffer(std::min<std::uint64_t>(bytes, 1 << 18));
    Checksum sum;
    while (bytes > 0 && file) {
        const auto part = std::min<std::uint64_t>(bytes, buffer.size());
        file.read(buffer.data(), static_cast<std::streamsize>(part));
        sum.add({buffer.data(), static_cast<std::size_t>(file.gcount())});
        bytes -= static_cast<std::uint64_t>(file.gcount());
    }
    if (!file)
        throw InputError(fmt::format("{}: the file cannot be read, or is shorter than it was", path.string()));
    return sum.value();
}

void seal(const fs::path& path) {
    std::error_code lost;
    const std::uint64_t bytes = fs::file_size(path, lost);
    const std::string line = lost ? "" : seal_line(bytes, checksum(path, 0, bytes));
    std::ofstream file(path, std::ios::binary | std::ios::app);
    file << line << std::flush;
    if (lost || !file)
        throw RunError(fmt::format("{}: cannot write the file ({}): check free space", path.string(), std::strerror(errno)));
}

void check_seal(const fs::path& path) {
    const std::string pattern = seal_line(0, 0);
    std::error_code unknown;
    const std::uint64_t length = fs::is_regular_file(path, unknown) ? fs::file_size(path, unknown) : 0;
    const std::uint64_t bytes = length < pattern.size() ? 0 : length - pattern.size();
    std::string line(static_cast<std::size_t>(length - bytes), '\0');
    std::ifstream file(path, std::ios::binary);
    file.seekg(static_cast<std::streamoff>(bytes));
    file.read(line.data(), static_cast<std::streamsize>(line.size()));
    if (!file)
        throw InputError(fmt::format("{}: the file cannot be read", path.string()));
    if (line.substr(0, 9) != pattern.substr(0, 9))
        throw InputError(fmt::format("{}: this is not a checkpoint, or not a whole one: the checksum at its end is missing (the "
                                     "file is cut off or damaged, or an earlier version wrote it): use another checkpoint.h5",
                                     path.string()));
    if (line != seal_line(bytes, checksum(path, 0, bytes)))
        throw InputError(
            fmt::format("{}: this checkpoint is damaged, its content does not fit its checksum: use another one", path.string()));
}

} // namespace ductile::io
