// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/io/checksum.hpp>
#include <ductile/io/interval.hpp>

#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <initializer_list>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace ductile::io {

/// A table with named columns; names carry units ("time_s", "shear_stress_Pa").
struct HistoryTable {
    std::vector<std::string> columns = {};
    std::vector<double> values = {}; ///< row after row

    [[nodiscard]] std::size_t rows() const { return columns.empty() ? 0 : values.size() / columns.size(); }
    /// One column from top to bottom, for plots and checks. Throws RunError for a name it does not have.
    [[nodiscard]] std::vector<double> column(std::string_view name) const;
};

/// Reads these columns of a history.csv back (all, if none is named); a last line without its end is left out. Throws
/// InputError for a file that is not such a table, RunError for a column it does not have.
[[nodiscard]] HistoryTable read_history(const std::filesystem::path& csv, const std::vector<std::string>& columns = {});
/// The same for a table that a user gives: its last line counts, ended or not, and lines may end as on other systems.
[[nodiscard]] HistoryTable read_table(const std::filesystem::path& csv);

/// How far a history had come when a checkpoint was written: what the file began with then.
struct HistoryMark {
    std::string columns = {}; ///< names, separated by commas
    std::int64_t rows = 0;
    std::int64_t bytes = 0;
    std::int64_t checksum = 0;

    bool operator==(const HistoryMark&) const = default;
};

/// What a continued run's history begins with.
struct EarlierHistory {
    std::filesystem::path csv; ///< the earlier run's history.csv; a .partial form goes first
    HistoryMark mark;
};

/// The table of a run: it goes to `history.csv.partial` as it grows, at least every second for those who follow, and is not kept
/// in memory; finish() (or the destructor) renames it to `history.csv`. Numbers are as short as they can be read back exactly.
class History {
public:
    /// Throws RunError when the file cannot be made, InputError when the earlier history has other columns or is damaged.
    History(std::filesystem::path csv, std::vector<std::string> columns, const std::optional<EarlierHistory>& earlier = {});
    ~History();
    History(const History&) = delete;
    History& operator=(const History&) = delete;

    /// One value a column. Throws RunError when the file cannot be written.
    void append(std::span<const double> row);
    void append(std::initializer_list<double> row) { append(std::span(row.begin(), row.size())); }

    /// Brings all rows to the disk and says how far they go: what a checkpoint keeps of them.
    [[nodiscard]] HistoryMark mark();
    /// The rows of the file so far; see read_history().
    [[nodiscard]] HistoryTable read(const std::vector<std::string>& columns = {});
    /// Says which earlier rows are missing because their file was gone; empty if none are.
    [[nodiscard]] const std::string& warning() const { return warning_; }

    /// Writes the rest, closes and renames. Harmless when repeated.
    void finish();

private:
    struct CloseFile {
        void operator()(std::FILE* file) const { std::fclose(file); }
    };

    void open(const char* mode);
    [[nodiscard]] bool go_on_from(const EarlierHistory& earlier);
    void write(std::string_view text);
    void flush();

    std::filesystem::path final_, partial_;
    std::vector<std::string> columns_;
    std::int64_t rows_ = 0, bytes_ = 0;
    Checksum checksum_;
    std::unique_ptr<std::FILE, CloseFile> file_;
    std::string line_, warning_;
    Interval flush_due_;
    bool finished_ = false;
};

} // namespace ductile::io
