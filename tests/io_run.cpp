// SPDX-License-Identifier: GPL-3.0-or-later
#include "io_scratch.hpp"
#include "messages.hpp"

#include <ductile/io/history.hpp>
#include <ductile/io/interrupt.hpp>
#include <ductile/io/progress.hpp>
#include <ductile/io/snapshots.hpp>
#include <ductile/io/summary.hpp>
#include <ductile/io/terminal_plot.hpp>
#include <ductile/io/text.hpp>

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <csignal>
#include <limits>
#include <malloc.h>
#include <regex>
#include <vector>

namespace io_run_suite {

using namespace ductile;
using namespace ductile::io;
namespace fs = std::filesystem;

namespace {

constexpr std::size_t index_block = 512; ///< what HDF5 leaves alone at the beginning of the file
constexpr SnapshotGrid grid{.cells_x = 4, .cells_y = 3, .width_m = 2.0, .height_m = 1.5, .left_m = -1.0, .bottom_m = -0.75};

/// Pressure at cells (1, 2, ...) and velocity at the corners of a periodic grid (10, 20, ...), with other units outside.
struct Scene {
    Scene() {
        for (std::size_t i = 0; i < 12; ++i)
            pressure.push_back(static_cast<double>(i + 1));
        for (std::size_t i = 0; i < 16; ++i)
            velocity.push_back(10.0 * static_cast<double>(i + 1));
    }
    void write(SnapshotWriter& writer, double time_s) const {
        const SnapshotField fields[] = {{"pressure", "Pa", Centring::cell, {pressure.data(), 3, 4, 4}, 1e9, 5.0},
                                        {"velocity", "m/s", Centring::corner, {velocity.data(), 4, 4, 4}}};
        writer.write(time_s, std::lround(time_s * 10), fields);
    }
    std::vector<double> pressure, velocity;
};

std::vector<double> read_array(const Hdf5File& file, const std::string& name, int rows, int columns) {
    std::vector<double> values(static_cast<std::size_t>(rows * columns));
    file.read(name, {values.data(), rows, columns, columns});
    return values;
}

/// Every dataset that the XDMF file names exists with the extents it states.
void check_xdmf(const fs::path& path, std::size_t snapshots) {
    const std::string text = scratch::read(path);
    const std::regex item("<DataItem Dimensions=\"([0-9 ]+)\"[^>]*>([^:<]+):/([^<]+)</DataItem>");
    std::size_t found = 0;
    for (std::sregex_iterator match(text.begin(), text.end(), item); match != std::sregex_iterator(); ++match, ++found) {
        std::string extents;
        for (const std::size_t extent : Hdf5File::open(path.parent_path() / (*match)[2].str()).shape((*match)[3].str()))
            extents.append(extents.empty() ? "" : " ").append(std::to_string(extent));
        CHECK(extents == (*match)[1].str());
    }
    CHECK(found == 4 * snapshots); // corners, cells and two fields each
}

} // namespace

TEST_SUITE_BEGIN("io_run");

TEST_CASE("snapshots hold the grid and the numbers in SI units, and ParaView finds them") {
    const scratch::Folder folder;
    const Scene scene;
    SnapshotWriter writer(folder / "fields.h5", "shear_band", grid, {}, {{"time_unit_s", 0.25}});
    scene.write(writer, 0.5);
    CHECK_FALSE(fs::exists(folder / "fields.h5"));
    check_xdmf(folder / "fields.xdmf", 1);
    scene.write(writer, 1.0);
    writer.finish();
    writer.finish();
    CHECK_FALSE(fs::exists(folder / "fields.h5.partial"));
    check_xdmf(folder / "fields.xdmf", 2);

    const Hdf5File file = Hdf5File::open(folder / "fields.h5");
    CHECK(file.text_attribute("/", "format") == "ductile fields 1");
    CHECK(file.text_attribute("/", "program") == "shear_band");
    CHECK(file.double_attribute("/", "time_unit_s") == 0.25);
    CHECK(file.read_doubles("grid/x_corner") == std::vector{-1.0, -0.5, 0.0, 0.5, 1.0});
    CHECK(file.read_doubles("grid/y_centre") == std::vector{-0.5, 0.0, 0.5});
    CHECK(file.integer_attribute("grid", "cells_x") == 4);
    const std::vector<double> corners = read_array(file, "grid/corners", 20, 2);
    CHECK(std::vector(corners.begin() + 10, corners.begin() + 14) == std::vector{-1.0, -0.25, -0.5, -0.25}); // the second row
    const std::vector<std::int64_t> cells = file.read_integers("grid/corners_of_cells");
    REQUIRE(cells.size() == 4 * 12);
    CHECK(std::vector(cells.begin() + 20, cells.begin() + 24) == std::vector<std::int64_t>{6, 7, 12, 11}); // of cell (1, 1)
    CHECK(file.double_attribute("snapshots/000001", "time_s") == 1.0);
    CHECK(file.integer_attribute("snapshots/000001", "step") == 10);
    CHECK(file.text_attribute("snapshots/000001/velocity", "centring") == "corner");
    CHECK(file.text_attribute("snapshots/000001/pressure", "units") == "Pa");
    const std::vector<double> pressure = read_array(file, "snapshots/000000/pressure", 3, 4);
    CHECK(pressure[0] == 1e9 + 5.0);
    CHECK(pressure[11] == 12e9 + 5.0);
    CHECK(read_array(file, "snapshots/000000/velocity", 4, 5) ==
          std::vector<double>{10, 20, 30, 40, 10, 50, 60, 70, 80, 50, 90, 100, 110, 120, 90, 130, 140, 150, 160, 130});
}

TEST_CASE("a continued run keeps the snapshots up to its checkpoint, from a killed run, too") {
    const scratch::Folder folder;
    const Scene scene;
    for (const char* earlier : {"fields.h5", "fields.h5.partial"}) {
        {
            SnapshotWriter writer(folder / "fields.h5", "shear_band", grid);
            for (const double time : {0.5, 1.0, 1.5})
                scene.write(writer, time);
        }
        if (fs::path(earlier).extension() == ".partial")
            fs::rename(folder / "fields.h5", folder / earlier);
        SnapshotWriter writer(folder / "fields.h5", "shear_band", grid, EarlierSnapshots{folder / "fields.h5", 1.0, 2});
        CHECK(writer.times() == std::vector{0.5, 1.0});
        scene.write(writer, 2.0);
        writer.finish();
        CHECK(Hdf5File::open(folder / "fields.h5").members("snapshots") ==
              std::vector<std::string>{"000000", "000001", "000002"});
        check_xdmf(folder / "fields.xdmf", 3);
    }
    SnapshotGrid other = grid;
    other.cells_x = 5;
    CHECK(contains(message_of<InputError>([&] {
                       SnapshotWriter(folder / "fields.h5", "shear_band", other, EarlierSnapshots{folder / "fields.h5", 1.0, 2});
                   }),
                   "the earlier snapshots are on another grid"));
}

TEST_CASE("a continued run knows torn and damaged snapshots, whatever HDF5 would make of the file") {
    const scratch::Folder folder;
    const Scene scene;
    const fs::path fields = folder / "fields.h5", partial = folder / "fields.h5.partial";
    std::vector<std::string> grown; // the file after each snapshot
    {
        SnapshotWriter writer(fields, "shear_band", grid);
        for (const double time : {0.5, 1.0, 1.5}) {
            scene.write(writer, time);
            grown.push_back(scratch::read(partial));
        }
    }
    fs::remove(fields);
    const auto go_on = [&](const std::string& found) {
        scratch::write(partial, found);
        SnapshotWriter writer(fields, "shear_band", grid, EarlierSnapshots{fields, 1.0, 2});
        CHECK(writer.times() == std::vector{0.5, 1.0});
        const std::string warning = writer.warning();
        scene.write(writer, 1.5);
        writer.finish();
        CHECK(scratch::read(fields) == grown[2]); // the bytes of a run that never stopped
        fs::remove(fields);
        return warning;
    };
    CHECK(go_on(grown[1]).empty());
    CHECK(go_on(grown[2]).empty());
    // A kill while HDF5 brings its book-keeping to the disk, in any order: of the old pages some are new already, or half.
    for (const std::size_t page : {std::size_t{0}, std::size_t{4096}, grown[1].size() / 2}) {
        std::string torn = grown[2];
        torn.replace(0, index_block, grown[1], 0, index_block); // this comes last, when the file is whole
        torn.replace(page + index_block, 1000, grown[1], page + index_block, 1000);
        CHECK(contains(go_on(torn.substr(0, grown[2].size() - 10)), "the 2 before it are kept"));
    }
    const auto refused = [&](const std::string& found) {
        scratch::write(partial, found);
        return message_of<InputError>([&] { SnapshotWriter(fields, "shear_band", grid, EarlierSnapshots{fields, 1.0, 2}); });
    };
    // every byte flipped: the same snapshots, or refused by name
    int same = 0, refusals = 0;
    for (std::size_t at = 0; at < grown[1].size(); at += grown[1].size() / 40) {
        std::string damaged = grown[1];
        damaged[at] = static_cast<char>(damaged[at] ^ 0x10);
        const std::string message = refused(damaged);
        const bool taken = message == "nothing was thrown";
        (taken ? same : refusals) += 1;
        if (taken) {
            CHECK(scratch::read(fields) == grown[1]);
            fs::remove(fields);
        } else {
            CHECK(contains(message, "fields.h5.partial: "));
        }
    }
    CHECK(same > 0);
    CHECK(refusals > 0);
    CHECK(contains(refused(grown[0]), "it has 1 snapshots up to the checkpoint, which knows of 2"));
    CHECK(contains(refused(grown[2].substr(0, 3000)), "it is cut off"));
    CHECK(contains(refused("text"), "fields.h5.partial: it is cut off"));
    fs::remove(partial);
    SnapshotWriter writer(fields, "shear_band", grid, EarlierSnapshots{fields, 1.0, 2});
    CHECK(contains(writer.warning(), "the file with the 2 earlier snapshots is gone"));
}

TEST_CASE("a full disk stops at the first snapshot without room; those before stay whole under the final name") {
    const scratch::Folder folder;
    const Scene scene;
    {
        SnapshotWriter writer(folder / "fields.h5", "shear_band", grid);
        scene.write(writer, 0.5);
        const scratch::FileSizeLimit limit(fs::file_size(folder / "fields.h5.partial") + 1000);
        const std::string text = message_of<RunError>([&] { scene.write(writer, 1.0); });
        CHECK(contains(text, "fields.h5: no room for the next snapshot"));
        CHECK(contains(text, "earlier snapshots kept: 1"));
    }
    CHECK(Hdf5File::open(folder / "fields.h5").members("snapshots").size() == 1);
    check_xdmf(folder / "fields.xdmf", 1);
}

TEST_CASE("a snapshot field of the wrong shape is refused before the file is touched") {
    const scratch::Folder folder;
    const Scene scene;
    SnapshotWriter writer(folder / "fields.h5", "shear_band", grid);
    const SnapshotField wrong[] = {{"pressure", "Pa", Centring::cell, {scene.pressure.data(), 4, 3, 3}}};
    CHECK(contains(message_of<RunError>([&] { writer.write(0.5, 1, wrong); }), "'pressure' has 4 x 3 values"));
    CHECK(writer.times().empty());
}

TEST_CASE("the history can be followed, is exact, and goes on from a checkpoint's mark byte by byte") {
    const scratch::Folder folder;
    const std::vector<std::string> columns = {"time_s", "stress_Pa"};
    const auto rows = [](io::History& history, int from, int to) {
        for (int i = from; i < to; ++i)
            history.append({0.1 * i, std::sqrt(static_cast<double>(i))});
    };
    HistoryMark mark;
    {
        io::History whole(folder / "whole.csv", columns);
        rows(whole, 0, 5);
        mark = whole.mark();
        CHECK(mark.rows == 5);
        CHECK(mark.bytes == static_cast<std::int64_t>(fs::file_size(folder / "whole.csv.partial"))); // it can be followed
        rows(whole, 5, 11);
        CHECK(whole.read({"stress_Pa"}).values.size() == 11);
    }
    const std::string text = scratch::read(folder / "whole.csv");
    CHECK(text.starts_with("time_s,stress_Pa\n0,0\n0.1,1\n0.2,1.4142135623730951\n0.30000000000000004,1.7320508075688772\n"));
    const HistoryTable table = read_history(folder / "whole.csv");
    CHECK(table.columns == columns);
    CHECK(table.column("time_s")[3] == 0.1 * 3);
    CHECK(table.column("stress_Pa").back() == std::sqrt(10.0));

    const EarlierHistory earlier{folder / "whole.csv", mark};
    const auto go_on = [&](const char* csv) {
        io::History continued(folder / csv, columns, earlier);
        rows(continued, 5, 11);
        CHECK(continued.mark().rows == 11);
        CHECK(continued.mark().checksum == checksum(text));
        continued.finish();
        CHECK(continued.warning().empty());
        CHECK(scratch::read(folder / csv) == text);
    };
    go_on("elsewhere.csv");
    CHECK(scratch::read(folder / "whole.csv") == text); // the first run's stays as it was
    go_on("whole.csv");
    scratch::write(folder / "whole.csv.partial", text + "0.7,to"); // what a killed run leaves: longer, and not whole
    go_on("whole.csv");
    scratch::write(folder / "whole.csv.partial", text.substr(0, 20)); // a shorter one is not what the checkpoint knew
    go_on("whole.csv");

    std::string changed = text;
    changed[30] = changed[30] == '4' ? '5' : '4';
    scratch::write(folder / "whole.csv", changed);
    CHECK(contains(message_of<InputError>([&] { io::History(folder / "a.csv", columns, earlier); }),
                   "whole.csv: the 5 rows up to the checkpoint are damaged"));
    fs::remove(folder / "whole.csv");
    {
        const io::History without(folder / "a.csv", columns, earlier);
        CHECK(contains(without.warning(), "the 5 earlier rows were in " + (folder / "whole.csv").string()));
    }
    CHECK(scratch::read(folder / "a.csv") == "time_s,stress_Pa\n");
    io::History other(folder / "other.csv", {"time_s"});
    CHECK(contains(message_of<InputError>([&] { io::History(folder / "b.csv", {"time_s"}, earlier); }), "start a new run"));
    CHECK(contains(message_of<RunError>([&] { other.append({1.0, 2.0}); }), "a row of 2 values for 1 columns"));
    CHECK(contains(message_of<RunError>([&] { (void)other.read({"load_N"}); }), "no column 'load_N'"));
    CHECK(contains(message_of<RunError>([&] { io::History(folder / "none/h.csv", columns); }), "cannot create"));
}

TEST_CASE("a history takes no memory that grows with its rows") {
    const scratch::Folder folder;
    io::History history(folder / "h.csv", {"a", "b", "c", "d"});
    for (int i = 0; i < 1000; ++i)
        history.append({1.0 * i, 2.0, 3.0, 4.0});
    const auto held = [] { return mallinfo2().uordblks; };
    const std::size_t before = held();
    for (int i = 0; i < 100'000; ++i)
        history.append({1.0 * i, 2.0, 3.0, 4.0});
    CHECK(held() < before + 10'000);
}

TEST_CASE("a history that cannot be written is a RunError") {
    const scratch::Folder folder;
    io::History history(folder / "h.csv", {"x"});
    for (int i = 0; i < 1000; ++i)
        history.append({1.0 / i});
    const scratch::FileSizeLimit limit(5000);
    CHECK(contains(message_of<RunError>([&] { history.finish(); }), "cannot write the history"));
    CHECK(fs::exists(folder / "h.csv.partial"));
}

TEST_CASE("the summary says everything, in order") {
    const scratch::Folder folder;
    RunSummary summary{.program = "upsetting", .version = "1", .parameters = {{"dt", 0.5}}};
    summary.status = RunStatus::failed;
    summary.reason = "step 7: not a number";
    summary.warnings = {"the energy ledger is open by 2 %: use a smaller --dt"};
    summary.steps = 7;
    summary.wall_seconds = 2.0;
    summary.phase_seconds = {{"transfer", 1.5}, {"solve", 0.5}};
    summary.extra = {{"load_N", 3.5}, {"rejected_substeps", 0}};
    summary.peak_memory_bytes = peak_memory_bytes();
    summary.processor_seconds = processor_seconds();
    CHECK(summary.processor_seconds > 0.0);
    CHECK(summary.processor_seconds < 3600.0);
    CHECK(summary.peak_memory_bytes > 1'000'000);
    write_summary(folder / "summary.json", summary);
    const auto json = nlohmann::ordered_json::parse(scratch::read(folder / "summary.json"));
    CHECK(json["status"] == "failed");
    CHECK(json["reason"] == "step 7: not a number");
    CHECK(json["warnings"] == std::vector<std::string>{"the energy ledger is open by 2 %: use a smaller --dt"});
    CHECK(json["parameters"]["dt"] == 0.5);
    CHECK(json["phase_seconds"].begin().key() == "transfer");
    for (const char* key : {"commit", "compiler", "machine"})
        CHECK(json[key].get<std::string>().size() > 6);
    for (const char* key : {"program", "version", "steps", "rejected_steps", "elliptic_solves", "pointwise_substeps",
                            "newton_iterations", "linear_iterations", "residual_evaluations", "jacobian_products", "wall_seconds",
                            "processor_seconds", "peak_memory_bytes"})
        CHECK(json.contains(key));
    const std::string text = describe(summary, folder / "");
    CHECK(contains(text, "upsetting: failed\n"));
    CHECK(contains(text, "transfer   1.5 s (75 %)"));
    CHECK(contains(text, "load         3.5 N\n"));
    CHECK_FALSE(contains(text, "rejected"));
    CHECK(contains(text, "(summary.json)"));
    CHECK(contains(text, "\nwarning: the energy ledger is open by 2 %: use a smaller --dt\n"));
}

TEST_CASE("the progress line tells where a run stands") {
    const Progress continued({.duration_s = 10.0, .start_s = 2.0, .quiet = true});
    CHECK(continued.line({.time_s = 4.0, .step = 12, .dt_s = 1e-3, .limit = "accuracy"}, 10.0) ==
          " 40.0 %  step 12  dt 0.001 s (accuracy)  elapsed 10.0 s  remaining 30.0 s");
    CHECK(contains(continued.line({.time_s = 2.0}, 0.0), "remaining -"));
}

TEST_CASE("a signal is remembered until the handlers are installed again") {
    const auto at_end = std::signal(SIGTERM, SIG_DFL);
    install_signal_handlers();
    CHECK_FALSE(interrupted());
    std::raise(SIGTERM);
    CHECK(interrupted());
    struct sigaction now {};
    sigaction(SIGTERM, nullptr, &now);
    CHECK((now.sa_handler == SIG_DFL)); // the second one kills
    install_signal_handlers();
    CHECK_FALSE(interrupted());
    std::signal(SIGTERM, at_end);
    std::signal(SIGINT, SIG_DFL);
    std::signal(SIGXFSZ, SIG_DFL);
}

TEST_CASE("a curve in the terminal has its axes and ticks") {
    const std::vector<double> x = {0.0, 0.25, 0.5, 0.75, 1.0}, y = {0.0, 1e9, 2e9, 3e9, 4e9};
    const std::string plot = terminal_plot(x, y, {.title = "loading", .x_label = "strain", .y_label = "stress [Pa]"});
    CHECK(std::ranges::count(plot, '\n') == 21); // title, y label, 16 lines, axis, its labels, x label
    for (const char* part : {"loading\nstress [Pa]\n", "4e+09 ┤", "0 ┤", "└┬─", "0.2", "strain\n", "⡠"})
        CHECK(contains(plot, part));
    const std::vector<double> constant(5, 3.0), gap = {1.0, std::nan(""), 2.0, std::numeric_limits<double>::infinity(), 1.0};
    CHECK(contains(terminal_plot(x, constant, {}), "3 ┤"));
    const std::vector<double> stress = {0.0, 300.0, 600.0, 900.0, 1050.0};
    CHECK(contains(terminal_plot(x, stress, {}), "\n1000 ┤"));
    CHECK(contains(terminal_plot(x, gap, {}), "1.4 ┤"));
    CHECK(contains(terminal_plot({}, {}, {}), "└"));
    // numbers whose differences are none
    const std::vector<double> huge = {-1.7e308, 1.7e308, 1.0, 0.0, 2.0}, tiny = {0.0, 5e-324, 0.0, 0.0, 0.0};
    CHECK(contains(terminal_plot(x, huge, {}), "2 ┤"));
    CHECK(contains(terminal_plot(x, tiny, {}), "0 ┤"));
    CHECK(contains(message_of<InputError>([&] { (void)terminal_plot(x, {}, {}); }), "5 values of x for 0 values of y"));
}

TEST_CASE("times and sizes for people") {
    CHECK(human_bytes(17) == "17 B");
    CHECK(human_bytes(3.2 * 1024 * 1024) == "3.2 MiB");
    CHECK(human_duration(0.44) == "0.4 s");
    CHECK(human_duration(59.96) == "1:00 min");
    CHECK(human_duration(125) == "2:05 min");
    CHECK(human_duration(11565) == "3:12:45 h");
    CHECK(human_duration(std::nan("")) == "-");
}

TEST_SUITE_END();

} // namespace io_run_suite
