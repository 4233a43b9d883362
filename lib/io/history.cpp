// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/base/error.hpp>
#include <ductile/io/atomic_file.hpp>
#include <ductile/io/history.hpp>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <iterator>
#include <unistd.h>
#include <utility>

namespace fs = std::filesystem;

namespace ductile::io {
namespace {

constexpr double flush_seconds = 1.0;

fs::path partial_form(fs::path csv) { return csv += ".partial"; }

bool begins_with(const fs::path& csv, const HistoryMark& mark) {
    try {
        return checksum(csv, 0, static_cast<std::uint64_t>(mark.bytes)) == mark.checksum;
    } catch (const InputError&) {
        return false;
    }
}

} // namespace

History::History(fs::path csv, std::vector<std::string> columns, const std::optional<EarlierHistory>& earlier)
    : final_(std::move(csv)), partial_(partial_form(final_)), columns_(std::move(columns)), flush_due_(flush_seconds) {
    if (earlier && go_on_from(*earlier))
        return;
    open("we");
    write(fmt::format("{}\n", fmt::join(columns_, ",")));
    flush();
}

History::~History() {
    try {
        finish();
    } catch (const Error&) {
        // The partial file stays behind; who wants to know calls finish().
    }
}

void History::open(const char* mode) {
    file_.reset(std::fopen(partial_.c_str(), mode));
    if (!file_)
        throw RunError(
            fmt::format("{}: cannot create the file ({}): check the output folder", partial_.string(), std::strerror(errno)));
}

/// Whether the earlier rows are there; they are then the beginning of this file.
bool History::go_on_from(const EarlierHistory& earlier) {
    const HistoryMark& mark = earlier.mark;
    const std::string names = fmt::format("{}", fmt::join(columns_, ","));
    if (mark.columns != names)
        throw InputError(
            fmt::format("the checkpoint's history has the columns {}, this run has {}: start a new run", mark.columns, names));
    const fs::path candidates[] = {partial_form(earlier.csv), earlier.csv};
    const auto* const found = std::ranges::find_if(candidates, [&](const fs::path& path) { return begins_with(path, mark); });
    if (found == std::end(candidates)) {
        const auto* const damaged = std::ranges::find_if(candidates, [](const fs::path& path) { return fs::exists(path); });
        if (damaged != std::end(candidates))
            throw InputError(fmt::format("{}: the {} rows up to the checkpoint are damaged or cut off, they do not fit the "
                                         "checkpoint's checksum: put the file back as it was, or move it away to go on without "
                                         "them",
                                         damaged->string(), mark.rows));
        warning_ = fmt::format("{} begins at the checkpoint: the {} earlier rows were in {}, which is gone; copy it to where it "
                               "was and restart again to have them",
                               final_.string(), mark.rows, earlier.csv.string());
        return false;
    }
    std::error_code different;
    if (!fs::equivalent(*found, partial_, different)) {
        AtomicFile copy(partial_);
        copy_beginning(*found, copy.temporary_path(), static_cast<std::uint64_t>(mark.bytes));
        copy.commit();
    } else if (::truncate(partial_.c_str(), mark.bytes) != 0) {
        throw RunError(fmt::format("{}: cannot shorten the file to the rows of the checkpoint ({}): check its permissions",
                                   partial_.string(), std::strerror(errno)));
    }
    open("ae");
    rows_ = mark.rows;
    bytes_ = mark.bytes;
    checksum_ = Checksum(static_cast<std::uint32_t>(mark.checksum));
    return true;
}

void History::append(std::span<const double> row) {
    if (row.size() != columns_.size())
        throw RunError(fmt::format("{}: a row of {} values for {} columns", partial_.string(), row.size(), columns_.size()));
    line_.clear();
    for (const double value : row)
        fmt::format_to(std::back_inserter(line_), "{},", value);
    line_.back() = '\n';
    write(line_);
    ++rows_;
    if (flush_due_.passed())
        flush();
}

void History::write(std::string_view text) {
    if (!file_)
        throw RunError(fmt::format("{}: the history could not be written before: check free space", partial_.string()));
    std::fwrite(text.data(), 1, text.size(), file_.get());
    bytes_ += static_cast<std::int64_t>(text.size());
    checksum_.add(text);
}

/// Finds failures of all writes since the last time; after one nothing more is written.
void History::flush() {
    if (std::fflush(file_.get()) == 0 && std::ferror(file_.get()) == 0)
        return;
    const std::string reason = std::strerror(errno);
    file_.reset();
    throw RunError(fmt::format("{}: cannot write the history ({}): check free space", partial_.string(), reason));
}

HistoryMark History::mark() {
    if (!file_)
        throw RunError(fmt::format("{}: the history could not be written before: check free space", partial_.string()));
    flush();
    ::fdatasync(::fileno(file_.get()));
    return {
        .columns = fmt::format("{}", fmt::join(columns_, ",")), .rows = rows_, .bytes = bytes_, .checksum = checksum_.value()};
}

HistoryTable History::read(const std::vector<std::string>& columns) {
    if (file_)
        flush();
    return read_history(finished_ ? final_ : partial_, columns);
}

void History::finish() {
    if (!file_)
        return;
    flush();
    file_.reset();
    rename_durably(partial_, final_);
    finished_ = true;
}

} // namespace ductile::io
