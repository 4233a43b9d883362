#include <ductile/base/error.hpp>
#include <ductile/io/atomic_file.hpp>
#include <ductile/io/history.hpp>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <iterator>
#include <utility>

namespace ductile::io {
namespace {

constexpr double flush_seconds = 1.0;

} // namespace

std::vector<double> HistoryTable::column(std::string_view name) const {
    const auto found = std::ranges::find(columns, name);
    if (found == columns.end())
        throw RunError(fmt::format("the history has no column '{}'; it has {}", name, fmt::join(columns, ", ")));
    std::vector<double> picked;
    picked.reserve(rows());
    for (auto at = static_cast<std::size_t>(found - columns.begin()); at < values.size(); at += columns.size())
        picked.push_back(values[at]);
    return picked;
}

History::History(std::filesystem::path csv, std::vector<std::string> columns, Options options)
    : final_(std::move(csv)), partial_(final_), options_(options), flush_due_(flush_seconds) {
    partial_ += ".partial";
    table_.columns = std::move(columns);
    open();
}

History::~History() {
    try {
        finish();
    } catch (const Error&) {
        // The partial file stays behind; who wants to know calls finish().
    }
}

void History::open() {
    file_.reset(std::fopen(partial_.c_str(), "we"));
    if (!file_)
        throw RunError(
            fmt::format("{}: cannot create the file ({}): check the output folder", partial_.string(), std::strerror(errno)));
    write(fmt::format("{}\n", fmt::join(table_.columns, ",")));
    flush();
}

void History::restore(const HistoryTable& table) {
    if (table.columns != table_.columns)
        throw InputError(fmt::format("the checkpoint's history has the columns {}, this run has {}: start a new run",
                                     fmt::join(table.columns, ","), fmt::join(table_.columns, ",")));
    table_ = table;
    skipped_.clear();
    open();
    const std::size_t width = table_.columns.size();
    for (std::size_t row = 0; row < table_.rows(); ++row)
        write_row(std::span(table_.values).subspan(row * width, width));
}

void History::append(std::span<const double> row) {
    if (row.size() != table_.columns.size())
        throw RunError(
            fmt::format("{}: a row of {} values for {} columns", partial_.string(), row.size(), table_.columns.size()));
    if (table_.offered++ % options_.every != 0) {
        skipped_.assign(row.begin(), row.end());
        return;
    }
    skipped_.clear();
    table_.values.insert(table_.values.end(), row.begin(), row.end());
    write_row(row);
    if (flush_due_.passed())
        flush();
}

void History::write_row(std::span<const double> row) {
    line_.clear();
    for (const double value : row)
        fmt::format_to(std::back_inserter(line_), "{},", value);
    line_.back() = '\n';
    write(line_);
}

void History::write(std::string_view text) { std::fwrite(text.data(), 1, text.size(), file_.get()); }

/// Finds failures of all writes since the last time; after one nothing more is written.
void History::flush() {
    if (std::fflush(file_.get()) == 0 && std::ferror(file_.get()) == 0)
        return;
    const std::string reason = std::strerror(errno);
    file_.reset();
    throw RunError(fmt::format("{}: cannot write the history ({}): check free space", partial_.string(), reason));
}

void History::finish() {
    if (!file_)
        return;
    if (!skipped_.empty())
        write_row(skipped_);
    flush();
    file_.reset();
    rename_durably(partial_, final_);
}

} // namespace ductile::io
