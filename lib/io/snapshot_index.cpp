// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/base/error.hpp>
#include <ductile/io/checksum.hpp>
#include <ductile/io/snapshot_index.hpp>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <fcntl.h>
#include <fstream>
#include <string_view>
#include <unistd.h>

namespace fs = std::filesystem;
using Json = nlohmann::json;

namespace ductile::io {
namespace {

constexpr std::string_view block_begin = "ductile snapshot index 1\n";

[[noreturn]] void refuse(const fs::path& path, const std::string& why) {
    throw InputError(fmt::format("{}: {}: move the file away to go on without the earlier snapshots, or put it back as it was",
                                 path.string(), why));
}

std::string block_text(const RecordPlace& newest, std::uint64_t length) {
    std::string text =
        fmt::format("{}{:016x} {:016x} {:08x} {:016x}\n", block_begin, newest.offset, newest.bytes, newest.checksum, length);
    text += fmt::format("{:08x}\n", checksum(text));
    return text;
}

/// Bytes of the file, no more than it has.
std::string read_bytes(const fs::path& path, std::uint64_t offset, std::uint64_t bytes) {
    std::error_code unknown;
    const std::uint64_t length = fs::file_size(path, unknown);
    if (unknown || offset > length || bytes > length - offset)
        refuse(path, "it is cut off");
    std::string text(bytes, '\0');
    std::ifstream file(path, std::ios::binary);
    file.seekg(static_cast<std::streamoff>(offset));
    file.read(text.data(), static_cast<std::streamsize>(bytes));
    if (!file)
        refuse(path, "it cannot be read");
    return text;
}

std::uint64_t hexadecimal(std::string_view text) {
    std::uint64_t value = 0;
    std::from_chars(text.data(), text.data() + text.size(), value, 16);
    return value;
}

} // namespace

std::size_t SnapshotDataset::values() const {
    std::size_t count = 1;
    for (const std::size_t extent : shape)
        count *= extent;
    return count;
}

std::string index_record(const std::string& head, const StoredSnapshot* snapshot, const RecordPlace& previous) {
    Json record;
    if (!snapshot)
        record["head"] = head;
    else {
        record = {{"group", snapshot->group}, {"time_s", snapshot->time_s}, {"step", snapshot->step}};
        record["previous"] = {previous.offset, previous.bytes, previous.checksum};
        record["datasets"] = Json::array();
        for (const SnapshotDataset& d : snapshot->datasets)
            record["datasets"].push_back({{"name", d.name},
                                          {"units", d.units},
                                          {"centring", d.centring},
                                          {"shape", d.shape},
                                          {"offset", d.offset},
                                          {"checksum", d.checksum}});
    }
    return record.dump();
}

void write_index_block(const fs::path& path, const RecordPlace& newest) {
    std::error_code unknown;
    std::string text = block_text(newest, fs::file_size(path, unknown));
    text.resize(index_block_bytes, ' ');
    const int file = ::open(path.c_str(), O_WRONLY | O_CLOEXEC);
    const bool written = file >= 0 && ::pwrite(file, text.data(), text.size(), 0) == static_cast<ssize_t>(text.size());
    const std::string reason = std::strerror(errno);
    if (file >= 0)
        ::close(file);
    if (!written)
        throw RunError(fmt::format("{}: cannot write the file ({}): check free space and whether the folder is still there",
                                   path.string(), reason));
}

SnapshotIndex read_index(const fs::path& path) {
    std::error_code unknown;
    if (fs::file_size(path, unknown) < index_block_bytes || unknown)
        refuse(path, "it is cut off");
    const std::string block = read_bytes(path, 0, index_block_bytes);
    if (!block.starts_with(block_begin))
        refuse(path, "it has no index of its snapshots (it is damaged, or an earlier version wrote it)");
    const auto number = [&](std::size_t at, std::size_t digits) {
        return hexadecimal(std::string_view(block).substr(block_begin.size() + at, digits));
    };
    RecordPlace place{number(0, 16), number(17, 16), static_cast<std::uint32_t>(number(34, 8))};
    const std::uint64_t length = number(43, 16);
    std::string expected = block_text(place, length);
    expected.resize(index_block_bytes, ' ');
    if (block != expected)
        refuse(path, "the index of its snapshots is damaged");

    SnapshotIndex index{.torn = fs::file_size(path, unknown) != length};
    while (true) {
        const std::string text = read_bytes(path, place.offset, place.bytes);
        if (checksum(text) != place.checksum)
            refuse(path, "the index of its snapshots is damaged");
        const Json record = Json::parse(text); // as it was written: its checksum says so
        if (record.contains("head")) {
            index.head = record["head"];
            break;
        }
        StoredSnapshot snapshot{.group = record["group"], .time_s = record["time_s"], .step = record["step"]};
        for (const Json& d : record["datasets"]) {
            SnapshotDataset dataset{d["name"], d["units"], d["centring"], d["shape"], d["offset"], d["checksum"]};
            if (const auto first = std::ranges::find(snapshot.datasets, dataset.offset, &SnapshotDataset::offset);
                first != snapshot.datasets.end() && dataset.values() > 0)
                dataset.same_as = first->name;
            snapshot.datasets.push_back(std::move(dataset));
        }
        index.snapshots.push_back(std::move(snapshot));
        const Json& previous = record["previous"];
        place = {previous[0], previous[1], previous[2]};
    }
    std::ranges::reverse(index.snapshots);
    return index;
}

std::vector<double> read_values(const fs::path& path, const StoredSnapshot& snapshot, const SnapshotDataset& dataset) {
    const std::string bytes = read_bytes(path, dataset.offset, sizeof(double) * dataset.values());
    if (checksum(bytes) != dataset.checksum)
        refuse(path, fmt::format("'{}/{}' is damaged, it does not fit its checksum", snapshot.group, dataset.name));
    std::vector<double> values(dataset.values());
    std::memcpy(values.data(), bytes.data(), bytes.size());
    return values;
}

} // namespace ductile::io
