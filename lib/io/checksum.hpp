// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string_view>

namespace ductile::io {

/// CRC-32 of bytes that come in pieces: any change of up to 32 neighbouring bits is seen for certain, any other but for one in
/// 2^32.
class Checksum {
public:
    /// Goes on from a value; 0 is that of no bytes.
    explicit Checksum(std::uint32_t value = 0) : value_(value) {}
    void add(std::string_view bytes);
    [[nodiscard]] std::uint32_t value() const { return value_; }

private:
    std::uint32_t value_;
};

[[nodiscard]] std::uint32_t checksum(std::string_view bytes);
/// Of a part of a file. Throws InputError when the file cannot be read or ends before the part does.
[[nodiscard]] std::uint32_t checksum(const std::filesystem::path& path, std::uint64_t offset, std::uint64_t bytes);

/// Seals a finished file: adds a last line with its length and checksum. Throws RunError.
void seal(const std::filesystem::path& path);
/// Throws InputError, naming the file, unless it is as it was when it was sealed, to the last bit.
void check_seal(const std::filesystem::path& path);

} // namespace ductile::io
