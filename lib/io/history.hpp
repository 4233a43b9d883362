#pragma once
#include <ductile/io/interval.hpp>

#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <initializer_list>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace ductile::io {

/// A table with named columns; names carry units ("time_s", "shear_stress_Pa").
struct HistoryTable {
    std::vector<std::string> columns = {};
    std::vector<double> values = {}; ///< row after row
    std::int64_t offered = 0;        ///< rows offered so far, those left out included: keeps "every n-th" in step after a restart

    [[nodiscard]] std::size_t rows() const { return columns.empty() ? 0 : values.size() / columns.size(); }
    /// One column from top to bottom, for plots and checks. Throws RunError for a name it does not have.
    [[nodiscard]] std::vector<double> column(std::string_view name) const;
};

/// The table of a run, kept in memory and written as it grows to `history.csv.partial`, at least every second for those who
/// follow; finish() (or the destructor) renames it to `history.csv`. Numbers are as short as they can be read back exactly.
class History {
public:
    struct Options {
        int every = 1; ///< keep the first row and every n-th after it; the last one is in the file, too
    };

    History(std::filesystem::path csv, std::vector<std::string> columns, Options options);
    History(std::filesystem::path csv, std::vector<std::string> columns)
        : History(std::move(csv), std::move(columns), Options{}) {}
    ~History();
    History(const History&) = delete;
    History& operator=(const History&) = delete;

    /// Begins again with the rows of a checkpoint. Throws InputError when its columns are others.
    void restore(const HistoryTable& table);

    /// One value a column. Throws RunError when the file cannot be written.
    void append(std::span<const double> row);
    void append(std::initializer_list<double> row) { append(std::span(row.begin(), row.size())); }

    /// Writes the rest, closes and renames. Harmless when repeated.
    void finish();

    [[nodiscard]] const HistoryTable& table() const { return table_; }

private:
    struct CloseFile {
        void operator()(std::FILE* file) const { std::fclose(file); }
    };

    void open();
    void write_row(std::span<const double> row);
    void write(std::string_view text);
    void flush();

    std::filesystem::path final_, partial_;
    Options options_;
    HistoryTable table_;
    std::vector<double> skipped_; ///< the newest row if it was left out
    std::unique_ptr<std::FILE, CloseFile> file_;
    std::string line_;
    Interval flush_due_;
};

} // namespace ductile::io
