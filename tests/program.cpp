// SPDX-License-Identifier: GPL-3.0-or-later
#include "io_scratch.hpp"
#include "messages.hpp"

#include <ductile/base/threads.hpp>
#include <ductile/io/interrupt.hpp>
#include <ductile/io/nearest_name.hpp>
#include <ductile/io/program.hpp>
#include <ductile/io/text.hpp>

#include <doctest/doctest.h>

#include <csignal>
#include <fcntl.h>
#include <functional>
#include <stdexcept>
#include <vector>

namespace program_suite {

using namespace ductile;
using namespace ductile::io;
namespace fs = std::filesystem;

namespace {

enum class Model { full, reduced };

/// A program with one option of every kind.
struct Demo {
    Demo() {
        program.option("--dt", dt, {"Time", "time step", "s", positive, Restart::may_change});
        program.option("--steps", steps, {"Time", "number of steps", "", at_least(1), Restart::may_change});
        program.option("--seed", seed, {"Time", "seed"});
        program.option("--cells", cells, {"Grid", "cells"});
        program.option("--snapshots", snapshots, {"Output", "times", "s", not_negative});
        program.option("--title", title, {"Output", "title"});
        program.option("--symmetric", symmetric, {"Grid", "half the grid"});
        program.choice("--model", model, {{"full", Model::full}, {"reduced", Model::reduced}}, {"Physics", "plasticity model"});
        program.number_or_auto("--tolerance", tolerance, {"Time", "tolerance", "", positive});
        program.choice("--step", step, {{"fixed", "fixed", "all alike"}, {"adaptive", "adaptive", "as accuracy asks"}},
                       {"Time", "step control"});
    }
    bool parse(std::vector<std::string> arguments) {
        arguments.insert(arguments.begin(), "demo");
        std::vector<const char*> argv;
        for (const std::string& argument : arguments)
            argv.push_back(argument.c_str());
        return program.parse(static_cast<int>(argv.size()), argv.data());
    }

    double dt = 0.1;
    int steps = 10;
    std::int64_t seed = -3;
    CellCount cells{64, 32};
    std::vector<double> snapshots = {0.5, 1.0 / 3.0};
    std::string title = "a 'quoted' title, # no comment";
    bool symmetric = false;
    Model model = Model::reduced;
    std::string step = "fixed", tolerance = "auto";
    Program program{"demo", "A program for tests."};
};

std::string refusal(const std::vector<std::string>& arguments) {
    return message_of<InputError>([&] { (void)Demo().parse(arguments); });
}

/// What an action writes to a standard stream.
std::string captured(int stream, const std::function<void()>& action) {
    const scratch::Folder folder;
    std::fflush(nullptr);
    const int kept = dup(stream), file = open((folder / "out").c_str(), O_WRONLY | O_CREAT, 0600);
    dup2(file, stream);
    action();
    std::fflush(nullptr);
    dup2(kept, stream);
    close(kept);
    close(file);
    return scratch::read(folder / "out");
}

void reset_signals() {
    for (int number = 1; number <= SIGRTMAX; ++number)
        std::signal(number, SIG_DFL);
}

} // namespace

TEST_SUITE_BEGIN("program");

TEST_CASE("options of every kind are read from the command line; the last of several counts") {
    Demo demo;
    CHECK(demo.parse({"--dt", "1e-3", "--steps=7", "--cells", "16x8", "--snapshots", "0,0.5, 1", "--title", "x", "--symmetric",
                      "--model", "full", "--seed", "-5", "--dt", "0.25"}));
    CHECK(demo.dt == 0.25);
    CHECK(demo.steps == 7);
    CHECK(demo.seed == -5);
    CHECK(demo.cells == CellCount{16, 8});
    CHECK(demo.snapshots == std::vector{0.0, 0.5, 1.0});
    CHECK(demo.title == "x");
    CHECK(demo.symmetric);
    CHECK(demo.model == Model::full);
    CHECK(demo.program.common().output == "out/demo");
}

TEST_CASE("impossible values are refused with the option's name and what is allowed") {
    for (const char* value : {"0", "-1", "nan", "inf", "1e400", "1e-400", "x", "", "1 2", "0x10", "--quiet"}) {
        CAPTURE(value);
        CHECK(contains(refusal({"--dt", value}), std::string("--dt ") + value + ": "));
        CHECK(contains(refusal({"--dt", value}), "must be a finite number above 0"));
    }
    for (const char* value : {"12.5", "-4", "0", "4x", "x4", "4x4x4", "1e3", "99999999999999999999", "4x-1"}) {
        CAPTURE(value);
        CHECK(contains(refusal({"--cells", value}), std::string("--cells ") + value + ": it must be N or MxN"));
    }
    for (const char* value : {"12.5", "0", "-1", "1e3", "9999999999"})
        CHECK(contains(refusal({"--steps", value}), std::string("--steps ") + value + ": it must be a whole number"));
    CHECK(contains(refusal({"--snapshots", "1,,2"}), "element '' is wrong"));
    CHECK(contains(refusal({"--snapshots", "1,-2"}), "element '-2' is wrong: it must be a finite number at least 0"));
    CHECK(contains(refusal({"--model", "none"}), "--model none: it must be one of full, reduced"));
    CHECK(contains(refusal({"--symmetric=maybe"}), "--symmetric maybe: it must be true or false"));
    CHECK(contains(refusal({"--threads", "0"}), "--threads 0: it must be a whole number from 1 to 4096"));
    CHECK(contains(refusal({"--no-such-option"}), "--no-such-option"));
    CHECK(contains(refusal({"stray"}), "stray"));
    CHECK(contains(refusal({"--dt"}), "--dt"));
    CHECK(contains(refusal({"--output", ""}), "--output: it must name a folder"));
    CHECK(contains(refusal({"--restart", "none.h5"}), "none.h5: there is no such file"));
    CHECK(contains(refusal({"--config", "none.toml"}), "none.toml: the file cannot be read"));
    CHECK(contains(refusal({"--config", "/"}), "the file cannot be read"));
}

TEST_CASE("--print-config prints a file that gives the same options") {
    Demo first;
    const std::string text = captured(STDOUT_FILENO, [&] {
        CHECK_FALSE(
            first.parse({"--dt", "0.1234567890123456", "--cells", "7x9", "--snapshots", "", "--quiet", "--print-config"}));
    });
    CHECK(contains(text, "# time step [s]; above 0 (default 0.1)\ndt=0.1234567890123456\n"));
    CHECK(contains(text, "snapshots=[]\n"));
    const scratch::Folder folder;
    scratch::write(folder / "a.toml", text);
    Demo second;
    CHECK(second.parse({"--config", (folder / "a.toml").string()}));
    CHECK(second.dt == first.dt);
    CHECK(second.cells == first.cells);
    CHECK(second.snapshots.empty());
    CHECK(second.title == first.title);
    CHECK(second.program.common().quiet);
    CHECK(second.program.config_text() == text);
    CHECK(second.program.parameters() == first.program.parameters());
    CHECK(first.program.parameters()["dt"] == first.dt);
    CHECK(first.program.parameters()["cells"] == "7x9");
    CHECK(first.program.parameters()["model"] == "reduced");
}

TEST_CASE("--help shows topics, units and defaults; --version the version") {
    const std::string help = captured(STDOUT_FILENO, [] { CHECK_FALSE(Demo().parse({"--help"})); });
    for (const char* part : {"Physics:", "General:", "time step [s]; above 0 (default 0.1)",
                             "one of full, reduced (default reduced)", "(default 64x32)", "--checkpoint-every", "--print-config"})
        CHECK(contains(help, part));
    CHECK(contains(captured(STDOUT_FILENO, [] { CHECK_FALSE(Demo().parse({"--version"})); }), "demo (ductile) "));
}

TEST_CASE("words are broken into lines as wide as asked, and a line's spaces stay") {
    CHECK(wrapped("one two three", 7) == "one two\nthree");
    CHECK(wrapped("one two three", 6) == "one\ntwo\nthree");
    CHECK(wrapped("one  two\n  a: three four", 9, "# ") == "# one two\n#   a:\n#       three\n#       four");
    CHECK(wrapped("unbreakable word", 4) == "unbreakable\nword");
    CHECK(wrapped("", 9) == "");
    CHECK(warning_line("a b") == "warning: a b\n");
    CHECK(warning_line("this is long", 14) == "warning: this\nis long\n");
}

TEST_CASE("help and printed configurations have lines that fit, and words of a choice lines of their own") {
    const auto widest = [](const std::string& text) {
        std::size_t most = 0;
        std::istringstream lines(text);
        for (std::string line; std::getline(lines, line);)
            most = std::max(most, line.size());
        return most;
    };
    const auto help_in = [](const char* columns) {
        setenv("COLUMNS", columns, 1);
        std::string help = captured(STDOUT_FILENO, [] { CHECK_FALSE(Demo().parse({"--help"})); });
        unsetenv("COLUMNS");
        return help;
    };
    CHECK(widest(help_in("80")) <= 80);
    CHECK(widest(help_in("80")) > 70);
    CHECK(widest(help_in("110")) <= 110);
    CHECK(widest(help_in("110")) > 100);
    CHECK(widest(help_in("5")) <= 60);
    CHECK(widest(help_in("word")) <= 100);
    const std::string space(34, ' ');
    CHECK(contains(help_in("80"), "\n" + space + "  fixed: all alike\n" + space + "  adaptive: as accuracy asks\n"));
    Demo demo;
    CHECK(demo.parse({}));
    CHECK(widest(demo.program.config_text()) <= 100);
    CHECK(contains(demo.program.config_text(), "\n#   fixed: all alike\n#   adaptive: as accuracy asks\nstep=\"fixed\"\n"));
}

TEST_CASE("a configuration file with unknown keys, wrong types or impossible values is refused with its line") {
    const scratch::Folder folder;
    const auto refused = [&](const std::string& text) {
        scratch::write(folder / "a.toml", "# comment\n" + text);
        return refusal({"--config", (folder / "a.toml").string()});
    };
    CHECK(contains(refused("dtt = 1"), "a.toml, line 2: unknown key 'dtt'"));
    CHECK(contains(refused("help = true"), "unknown key 'help'"));
    CHECK(contains(refused("dt = \"fast\""), "line 2: --dt fast: it must be a finite number above 0"));
    CHECK(contains(refused("dt = [1, 2]"), "line 2: key 'dt' is an array"));
    CHECK(contains(refused("steps = 1e3"), "--steps 1000.0: it must be a whole number"));
    CHECK(contains(refused("steps = 1.5"), "--steps 1.5: it must be a whole number"));
    CHECK(contains(refused("symmetric = 1"), "--symmetric 1: it must be true or false"));
    CHECK(contains(refused("title = bare words"), "texts in quotes"));
    CHECK(contains(refused("cells = 1.5"), "--cells 1.5: it must be N or MxN"));
    CHECK(contains(refused("snapshots = [1, \"x\"]"), "element 'x' is wrong"));
    CHECK(contains(refused("dt = 0"), "line 2: --dt 0: it must be a finite number above 0"));
    CHECK(contains(refused("dt = nan"), "--dt nan"));
    CHECK(contains(refused("dt = 1\ndt = 2"), "line 3: "));
    CHECK(contains(refused("dt = 1\ndt = 2"), "cannot redefine"));
    for (const char* no_pair : {"dt",
                                "symmetric",
                                "= 1",
                                "x =",
                                "[time]\ndt = 1",
                                "[default]",
                                "time.dt = 1",
                                "; dt = 1",
                                "dt = ",
                                "dt = 1 2",
                                "dt = 1,5",
                                "dt = 0x",
                                "dt = 1__0",
                                "dt = .5",
                                "dt = 5.",
                                "dt = 05",
                                "title = \"a",
                                "title = \"\\q\"",
                                "snapshots = [1 2]",
                                "title = \"a\xff\"",
                                "dt = {a = 1}"})
        CHECK(contains(refused(no_pair), "a.toml, line 2: "));
    CHECK(contains(refused("dt = 2020-01-01"), "line 2: dates and times of day are not used"));
    CHECK(contains(refused("snapshots = [[1]]"), "line 2: arrays in arrays are not used"));
    CHECK(contains(refused("[time]\ndt = 1"), "tables are not used"));
    CHECK(contains(refused("\n\nsnapshots = [1,\n 23"), "line 5: "));
    CHECK(contains(refused("dt = \"5\\u0000\""), "line 2: --dt 5\\x00: it must be a finite number above 0"));
    CHECK(contains(refused("steps = 9223372036854775808"), "line 2: "));
    CHECK(contains(refused("celss = 8"), "line 2: unknown key 'celss'; did you mean cells?"));
    CHECK(contains(refused("checkpoint_every = 8"), "unknown key 'checkpoint_every'; did you mean checkpoint-every?"));
    CHECK(contains(refusal({"--title", "a\nb"}), "--title a\\x0ab: it must be UTF-8 text without control characters"));
    CHECK(contains(refusal({"--title", "\xe4"}), "it must be UTF-8 text"));
}

TEST_CASE("a configuration file is TOML") {
    const scratch::Folder folder;
    const auto read = [&](const std::string& text) {
        scratch::write(folder / "a.toml", text);
        Demo demo;
        CHECK(demo.parse({"--config", (folder / "a.toml").string()}));
        return std::tuple{demo.dt, demo.steps, demo.snapshots, demo.title};
    };
    const auto [dt, steps, snapshots, title] =
        read("snapshots = [ 1, # one\r\n 20.5,\n]\r\ncells = '8x4'\r\ntitle = 'a # b'  # c\ndt = 1_0.0\nsteps = 0x1_0");
    CHECK(dt == 10.0);
    CHECK(steps == 16);
    CHECK(snapshots == std::vector{1.0, 20.5});
    CHECK(title == "a # b");
    CHECK(std::get<0>(read("dt = +1e-3")) == 1e-3);
    CHECK(std::get<3>(read("title = \"\\\"a\\\" \\\\ \\u00e4\"")) == "\"a\" \\ \u00e4");
    CHECK(std::get<0>(read("")) == 0.1);
}

TEST_CASE("files that editors on other systems have saved are named as such") {
    const scratch::Folder folder;
    const auto refused = [&](const std::string& text) {
        scratch::write(folder / "a.toml", text);
        return refusal({"--config", (folder / "a.toml").string()});
    };
    CHECK(contains(refused("\xef\xbb\xbf"
                           "dt = 1\n"),
                   "a.toml, line 1: the file begins with a byte-order mark (BOM)"));
    CHECK(contains(refused(std::string("\xff\xfe"
                                       "d\0t\0",
                                       6)),
                   "UTF-16"));
    CHECK(contains(refused(std::string("\xfe\xff\0d\0t", 6)), "UTF-16"));
    CHECK(contains(refused(std::string("dt = 5\0\n", 8)), "null characters"));
}

TEST_CASE("of several configuration files the last goes first") {
    const scratch::Folder folder;
    scratch::write(folder / "a.toml", "dt = 1\nsteps = 1\nseed = 1\n");
    scratch::write(folder / "b.toml", "dt = 2\nsteps = 2\n");
    Demo demo;
    CHECK(demo.parse({"--config", (folder / "a.toml").string(), "--dt", "3", "--config", (folder / "b.toml").string()}));
    CHECK(demo.dt == 3.0);
    CHECK(demo.steps == 2);
    CHECK(demo.seed == 1);
}

TEST_CASE("texts of any kind come back from a configuration") {
    for (const char* text :
         {"\"quoted\"", "back\\slash", "C:\\dir\\", "# no comment", "[1]", ".5", "nan", "\u00e4\u00f6", "a 'b' \"c\""}) {
        CAPTURE(text);
        const scratch::Folder folder;
        Demo first;
        REQUIRE(first.parse({"--title", text}));
        scratch::write(folder / "a.toml", first.program.config_text());
        Demo second;
        REQUIRE(second.parse({"--config", (folder / "a.toml").string()}));
        CHECK(second.title == text);
    }
}

TEST_CASE("a number or auto is checked even where nobody will use it") {
    for (const char* value : {"nan", "inf", "-1", "0", "", "automatic", "5x"})
        CHECK(contains(refusal({"--tolerance", value}),
                       std::string("--tolerance ") + value + ": it must be a finite number above 0; or auto"));
    CHECK(contains(refusal({"--tolerance", "1e999"}), "cannot be represented"));
    Demo demo;
    CHECK(demo.parse({"--tolerance", ".5"}));
    CHECK(demo.tolerance == ".5");
    CHECK(contains(demo.program.config_text(), "\ntolerance=0.5\n"));
    CHECK(contains(Demo().program.config_text(), "\ntolerance=\"auto\"\n"));
}

TEST_CASE("a mistyped name is answered with the nearest") {
    CHECK(contains(refusal({"--celss", "8"}), "there is no option --celss; did you mean --cells?"));
    CHECK(contains(refusal({"--celss=8"}), "there is no option --celss; did you mean --cells?"));
    CHECK(contains(refusal({"-cells", "8"}), "there is no option -cells; did you mean --cells?"));
    CHECK(contains(refusal({"--snap", "8"}), "did you mean --snapshots?"));
    CHECK(contains(refusal({"--hlep"}), "did you mean --help?"));
    CHECK_FALSE(contains(refusal({"--wholly-else", "x"}), "did you mean"));
    CHECK(contains(refusal({"stray"}), "'stray' was not expected"));
    CHECK(contains(refusal({"--model", "redcued"}), "it must be one of full, reduced; did you mean reduced?"));
    CHECK(contains(refusal({"--step", "adapt"}), "did you mean adaptive?"));
    CHECK_FALSE(contains(refusal({"--model", "none"}), "did you mean"));

    CHECK(edit_distance("", "abc") == 3);
    CHECK(edit_distance("kitten", "sitting") == 3);
    CHECK(edit_distance("celss", "cells") == 1);
    CHECK(edit_distance("ca", "abc") == 3);
    CHECK(edit_distance("same", "same") == 0);
}

TEST_CASE("the command line goes before --config, --config before the checkpoint, the checkpoint before defaults") {
    const scratch::Folder folder;
    fs::create_directory(folder / "run");
    const fs::path checkpoint = folder / "run/checkpoint.h5";
    const auto store = [&](const std::string& config) { write_checkpoint(checkpoint, {.program = "demo", .config = config}); };
    store("dt = 1\nsteps = 1\nseed = 1\noutput = \"elsewhere\"\nquiet = true\nrestart = \"older.h5\"\n");
    scratch::write(folder / "a.toml", "dt = 2\nsteps = 2\nrestart = '" + checkpoint.string() + "'\n");
    Demo demo;
    CHECK(demo.parse({"--dt", "3", "--config", (folder / "a.toml").string()}));
    CHECK(demo.dt == 3.0);
    CHECK(demo.steps == 2);
    CHECK(demo.seed == 1);
    CHECK_FALSE(demo.program.common().quiet);
    CHECK(demo.cells == CellCount{64, 32});
    CHECK(demo.program.common().restart == checkpoint);
    CHECK(demo.program.common().output == folder / "run"); // a continued run stays where its checkpoint is
    REQUIRE(demo.program.open_restart(1));
    CHECK(contains(message_of<InputError>([&] { (void)demo.program.open_restart(2); }), "has format 1"));

    Demo elsewhere;
    CHECK(elsewhere.parse({"--restart", checkpoint.string(), "--output", "x"}));
    CHECK(elsewhere.program.common().output == "x");
    store("gone = 1");
    CHECK(contains(refusal({"--restart", checkpoint.string()}), "checkpoint.h5, line 1: unknown key 'gone'"));
}

TEST_CASE("a continued run keeps its scene: another value is refused with both named, the same one is not") {
    const scratch::Folder folder;
    const std::string checkpoint = folder / "checkpoint.h5";
    write_checkpoint(checkpoint, {.program = "demo",
                                  .config = "dt = 1\nseed = 7\ncells = \"16x8\"\nsnapshots = [1, 2]\nmodel = \"full\"\n"
                                            "symmetric = true\ntitle = \"old\"\nstep = \"fixed\"\n"});
    for (const auto& [flag, value, message] :
         {std::tuple{"--seed", "8", "--seed: the checkpoint has 7, this run asks for 8"},
          {"--cells", "16", "--cells: the checkpoint has 16x8, this run asks for 16"},
          {"--snapshots", "1,2.5", "--snapshots: the checkpoint has 1,2, this run asks for 1,2.5"},
          {"--model", "reduced", "--model: the checkpoint has full, this run asks for reduced"},
          {"--title", "new", "--title: the checkpoint has old, this run asks for new"},
          {"--step", "adaptive", "--step: the checkpoint has fixed, this run asks for adaptive"}})
        CHECK(contains(refusal({"--restart", checkpoint, flag, value}), message));
    CHECK(contains(refusal({"--restart", checkpoint, "--seed", "8", "--model", "reduced"}), "asks for 8; --model: the"));
    scratch::write(folder / "a.toml", "seed = 9\n");
    CHECK(
        contains(refusal({"--restart", checkpoint, "--config", folder / "a.toml"}), "the checkpoint has 7, this run asks for 9"));
    Demo demo;
    CHECK(demo.parse(
        {"--restart", checkpoint, "--seed", "7", "--cells", "16x8", "--symmetric", "--model", "full", "--dt", "0.25"}));
    CHECK(demo.seed == 7);
    CHECK(demo.cells == CellCount{16, 8});
    CHECK(demo.model == Model::full);
    CHECK(demo.dt == 0.25); // does not belong to the scene
    CHECK(demo.title == "old");
}

TEST_CASE("--threads sets the number of threads") {
    const int before = thread_count();
    Demo demo;
    CHECK(demo.parse({"--threads", "1"}));
    CHECK(thread_count() == 1);
    set_thread_count(before);
}

TEST_CASE("a run ends with a summary and its status, whatever happens") {
    const scratch::Folder folder;
    const auto run = [&](const std::function<RunStatus(RunSummary&)>& body) {
        return run_main([&] {
            Demo demo;
            if (!demo.parse({"--output", (folder / "out").string(), "--quiet"}))
                return 3;
            return demo.program.run([&](const OutputFolder&, RunSummary& summary) { return body(summary); });
        });
    };
    const auto warned = [&](const std::vector<const char*>& more) {
        return captured(STDOUT_FILENO, [&] {
            Demo demo;
            std::vector<std::string> options{"--output", (folder / "warned").string()};
            options.insert(options.end(), more.begin(), more.end());
            REQUIRE(demo.parse(options));
            CHECK(demo.program.run(
                      [](const OutputFolder&, RunSummary& done) {
                          done.warnings.emplace_back("the step was long");
                          return RunStatus::completed;
                      },
                      {"the yield stress is high"}) == 0);
        });
    };
    const auto summary = [&] { return nlohmann::json::parse(scratch::read(folder / "out/summary.json")); };

    const std::string silence = captured(STDOUT_FILENO, [&] {
        CHECK(run([](RunSummary& done) {
                  done.steps = 5;
                  return RunStatus::completed;
              }) == 0);
    });
    CHECK(silence.empty());
    CHECK(summary()["status"] == "completed");
    CHECK(summary()["steps"] == 5);
    CHECK(summary()["parameters"]["output"] == (folder / "out").string());

    CHECK(run([](RunSummary&) {
              std::raise(SIGINT);
              return interrupted() ? RunStatus::interrupted : RunStatus::completed;
          }) == interrupted_exit_status);
    CHECK(summary()["status"] == "interrupted");

    const std::string text = warned({});
    CHECK(text.find("warning: the yield stress is high\n") < text.find("completed"));
    CHECK(contains(text.substr(text.find("completed")), "warning: the yield stress is high\nwarning: the step was long\n"));
    CHECK(warned({"--quiet"}).empty());
    CHECK(nlohmann::json::parse(scratch::read(folder / "warned/summary.json"))["warnings"].size() == 2);

    const std::string complaint = captured(
        STDERR_FILENO, [&] { CHECK(run([](RunSummary&) -> RunStatus { throw RunError("step 3: the disk is full"); }) == 1); });
    CHECK(complaint == "error: step 3: the disk is full\n");
    CHECK(summary()["status"] == "failed");
    CHECK(summary()["reason"] == "step 3: the disk is full");
    CHECK(fs::exists(folder / "out.2/summary.json")); // both earlier runs are still there
    reset_signals();
}

TEST_CASE("whatever signal asks a run to end only raises a flag; crashes are left alone") {
    reset_signals();
    const auto asked = [](int number) {
        install_signal_handlers();
        CHECK_FALSE(interrupted());
        std::raise(number);
        const bool flag = interrupted();
        reset_signals();
        return flag;
    };
    for (const int number : {SIGINT, SIGTERM, SIGHUP, SIGQUIT, SIGUSR1, SIGUSR2, SIGXCPU, SIGALRM, SIGVTALRM, SIGPROF, SIGIO,
                             SIGPWR, SIGSTKFLT, SIGPIPE, SIGRTMIN, SIGRTMAX}) {
        CAPTURE(number);
        CHECK(asked(number));
    }
    const auto action_after = [](int number, void (*before)(int)) {
        std::signal(number, before);
        install_signal_handlers();
        struct sigaction now {};
        sigaction(number, nullptr, &now);
        reset_signals();
        return now;
    };
    for (const int number : {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT, SIGTRAP, SIGSYS, SIGCHLD, SIGTSTP, SIGWINCH})
        CHECK((action_after(number, SIG_DFL).sa_handler == SIG_DFL));
    for (const int number : {SIGHUP, SIGUSR1, SIGXCPU, SIGALRM}) // nohup and its like
        CHECK((action_after(number, SIG_IGN).sa_handler == SIG_IGN));
    for (const int number : {SIGINT, SIGQUIT, SIGPIPE}) // what shells do to commands in the background
        CHECK((action_after(number, SIG_IGN).sa_handler != SIG_IGN));
    for (const int number : {SIGINT, SIGTERM, SIGHUP, SIGUSR1}) // the second kills
        CHECK((action_after(number, SIG_DFL).sa_flags & static_cast<int>(SA_RESETHAND)) != 0);
    for (const int number : {SIGPIPE, SIGXCPU}) // the second comes by itself
        CHECK((action_after(number, SIG_DFL).sa_flags & static_cast<int>(SA_RESETHAND)) == 0);
}

TEST_CASE("a run whose output nobody reads any more ends as one that was interrupted") {
    const scratch::Folder folder;
    std::fflush(nullptr);
    int ends[2];
    REQUIRE(pipe(ends) == 0);
    const int kept = dup(STDOUT_FILENO);
    dup2(ends[1], STDOUT_FILENO);
    close(ends[1]);
    close(ends[0]);
    const int status = run_main([&] {
        Demo demo;
        CHECK(demo.parse({"--output", (folder / "out").string()}));
        return demo.program.run([&](const OutputFolder&, RunSummary&) {
            demo.program.say("a line\n");
            demo.program.say("another\n");
            return interrupted() ? RunStatus::interrupted : RunStatus::completed;
        });
    });
    dup2(kept, STDOUT_FILENO);
    close(kept);
    std::clearerr(stdout);
    CHECK(status == interrupted_exit_status);
    CHECK(nlohmann::json::parse(scratch::read(folder / "out/summary.json"))["status"] == "interrupted");
    reset_signals();
}

TEST_CASE("every exception becomes one message and a status") {
    const auto status_of = [](const std::function<int()>& body, const std::string& expected) {
        int status = 0;
        CHECK(captured(STDERR_FILENO, [&] { status = run_main(body); }) == expected);
        return status;
    };
    CHECK(status_of([] { return 0; }, "") == 0);
    CHECK(status_of([]() -> int { throw InputError("--dt"); }, "error: --dt\n") == 2);
    CHECK(status_of([]() -> int { throw std::runtime_error("odd"); }, "error: odd\n") == 1);
    CHECK(status_of([]() -> int { throw std::bad_alloc(); },
                    "error: there is not enough memory: use fewer cells or particles\n") == 1);
}

TEST_CASE("bad input leaves nothing behind") {
    const scratch::Folder folder;
    CHECK(contains(refusal({"--output", (folder / "out").string(), "--dt", "0"}), "--dt 0"));
    CHECK_FALSE(fs::exists(folder / "out"));
}

TEST_SUITE_END();

} // namespace program_suite
