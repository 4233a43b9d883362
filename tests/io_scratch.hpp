// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/base/error.hpp>

#include <csignal>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <sys/resource.h>
#include <unistd.h>

namespace scratch {

namespace fs = std::filesystem;

/// A folder of its own for one test, removed at its end.
class Folder {
public:
    Folder() {
        std::string name = (fs::temp_directory_path() / "ductile-test-XXXXXX").string();
        path_ = mkdtemp(name.data());
    }
    ~Folder() { fs::remove_all(path_); }
    Folder(const Folder&) = delete;
    Folder& operator=(const Folder&) = delete;
    fs::path operator/(const std::string& name) const { return path_ / name; }

private:
    fs::path path_;
};

/// While it lives no file of this process may grow beyond so many bytes: the nearest thing to a full disk.
class FileSizeLimit {
public:
    explicit FileSizeLimit(rlim_t bytes) {
        handler_ = std::signal(SIGXFSZ, SIG_IGN);
        getrlimit(RLIMIT_FSIZE, &before_);
        const rlimit limit{bytes, before_.rlim_max};
        setrlimit(RLIMIT_FSIZE, &limit);
    }
    ~FileSizeLimit() {
        setrlimit(RLIMIT_FSIZE, &before_);
        std::signal(SIGXFSZ, handler_);
    }
    FileSizeLimit(const FileSizeLimit&) = delete;
    FileSizeLimit& operator=(const FileSizeLimit&) = delete;

private:
    rlimit before_{};
    void (*handler_)(int);
};

inline std::string read(const fs::path& path) {
    std::ifstream file(path);
    return {std::istreambuf_iterator<char>(file), {}};
}

inline void write(const fs::path& path, const std::string& text) { std::ofstream(path) << text; }

/// As a kill leaves a run's folder that comes between the last checkpoint and the end of the files, in the middle of a row.
inline void leave_as_killed(const fs::path& folder) {
    fs::remove(folder / "summary.json");
    fs::remove(folder / "fields.xdmf");
    for (const std::string file : {"history.csv", "fields.h5"})
        fs::rename(folder / file, folder / (file + ".partial"));
    std::ofstream(folder / "history.csv.partial", std::ios::app) << "1,2,";
}

} // namespace scratch
