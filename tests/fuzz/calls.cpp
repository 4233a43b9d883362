// SPDX-License-Identifier: GPL-3.0-or-later
#include "calls.hpp"

#include <ductile/base/error.hpp>
#include <ductile/base/memory.hpp>
#include <ductile/io/interrupt.hpp>
#include <ductile/io/program.hpp>

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <unistd.h>

int colliding_disks_main(int, char**);
int elastic_bar_main(int, char**);
int material_point_main(int, char**);
int plastic_bar_main(int, char**);
int scene_main(int, char**);
int shear_band_main(int, char**);
int taylor_bar_main(int, char**);
int upsetting_main(int, char**);
int vibrating_bar_main(int, char**);

namespace {
int questions_left = 0;
} // namespace

// In place of the library's.
namespace ductile {
double machine_memory_bytes() { return 64e6; }
} // namespace ductile
namespace ductile::io {
void install_signal_handlers() {}
bool interrupted() noexcept { return questions_left-- <= 0; }
/// In place of run_main(): exceptions go on.
int call_body(const std::function<int()>& body) { return body(); }
} // namespace ductile::io

/// HDF5 loses some memory where reading fails.
extern "C" const char* __lsan_default_suppressions();
extern "C" const char* __lsan_default_suppressions() { return "leak:libhdf5"; }

namespace fs = std::filesystem;

namespace ductile::fuzz {

Folder::Folder() {
    std::string name = (fs::is_directory("/dev/shm") ? fs::path("/dev/shm") : fs::temp_directory_path()) / "ductile-fuzz-XXXXXX";
    path_ = mkdtemp(name.data());
}

Folder::~Folder() {
    std::error_code gone;
    fs::remove_all(path_, gone);
}

Program program_named(std::string_view name) {
    constexpr std::array<std::pair<std::string_view, Program>, 9> programs{{{"colliding_disks", colliding_disks_main},
                                                                            {"elastic_bar", elastic_bar_main},
                                                                            {"material_point", material_point_main},
                                                                            {"plastic_bar", plastic_bar_main},
                                                                            {"scene", scene_main},
                                                                            {"shear_band", shear_band_main},
                                                                            {"taylor_bar", taylor_bar_main},
                                                                            {"upsetting", upsetting_main},
                                                                            {"vibrating_bar", vibrating_bar_main}}};
    for (const auto& [known, program] : programs)
        if (known == name)
            return program;
    return nullptr;
}

void write(const fs::path& path, std::string_view bytes) { std::ofstream(path, std::ios::binary) << bytes; }

void interrupt_after(int questions) { questions_left = questions; }

void call(Program program, std::vector<std::string> words, const fs::path& output, Keep keep) {
    static const bool silent = std::freopen("/dev/null", "w", stdout) != nullptr;
    static_cast<void>(silent);
    words.insert(words.end(), {"--output", output.string(), "--threads", "1", "--quiet"});
    std::vector<char*> argv;
    for (std::string& word : words)
        argv.push_back(word.data());
    argv.push_back(nullptr);

    const auto broken = [](const std::string& promise) {
        fmt::print(stderr, "BROKEN PROMISE: {}\n", promise);
        std::abort();
    };
    const bool restarts = std::ranges::any_of(words, [](const std::string& word) { return word.starts_with("--restart"); });
    try {
        (void)program(static_cast<int>(words.size()), argv.data());
    } catch (const Error& error) {
        if (std::string_view(error.what()).empty())
            broken("an error has no message");
        if (error.exit_status() == 2 && !restarts && fs::exists(output))
            broken(fmt::format("'{}' was noticed after something was written", error.what()));
    }
    questions_left = 0;
    if (keep == Keep::nothing)
        fs::remove_all(output);
}

} // namespace ductile::fuzz
