// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/base/error.hpp>
#include <ductile/io/output_folder.hpp>

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <fcntl.h>
#include <string>
#include <sys/file.h>
#include <unistd.h>

namespace fs = std::filesystem;

namespace ductile::io {
namespace {

[[noreturn]] void refuse(const fs::path& folder, const std::string& why) {
    throw InputError(fmt::format("output folder {}: {}: choose another one with --output", folder.string(), why));
}

bool holds_a_run(const fs::path& folder) {
    constexpr std::array files = {"summary.json", "history.csv", "fields.h5", "checkpoint.h5"};
    return std::ranges::any_of(files, [&](const char* file) {
        const fs::path path = folder / file;
        return fs::exists(path) || fs::exists(path.string() + ".partial");
    });
}

bool lies_in(const fs::path& path, const fs::path& folder) {
    return std::mismatch(folder.begin(), folder.end(), path.begin(), path.end()).first == folder.end();
}

void check_writable(const fs::path& folder) {
    const fs::path probe = folder / ".ductile-write-test";
    const int file = ::open(probe.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
    if (file < 0)
        refuse(folder, fmt::format("files cannot be written there ({})", std::strerror(errno)));
    ::close(file);
    ::unlink(probe.c_str());
}

} // namespace

OutputFolder::OutputFolder(const fs::path& folder, const fs::path& restart) : path_(folder.lexically_normal()) {
    if (!path_.has_filename())
        path_ = path_.parent_path();
    try {
        if (fs::exists(path_) && !fs::is_directory(path_))
            refuse(path_, "this is not a folder");
        if (fs::exists(path_)) {
            claim();
            continued_ = !restart.empty() && fs::equivalent(fs::absolute(restart).parent_path(), path_);
            if (!continued_ && holds_a_run(path_))
                move_aside(restart);
        }
        if (lock_.descriptor < 0) {
            fs::create_directories(path_);
            claim();
        }
        check_writable(path_);
    } catch (const fs::filesystem_error& error) {
        refuse(path_, fmt::format("cannot be made ({})", error.code().message()));
    }
}

OutputFolder::Lock::~Lock() { release(); }

void OutputFolder::Lock::release() {
    if (descriptor >= 0)
        ::close(descriptor);
    descriptor = -1;
}

// The lock sits on the folder itself: no file is left behind, and the system drops it when the process dies.
void OutputFolder::claim() {
    lock_.descriptor = ::open(path_.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (lock_.descriptor >= 0 && ::flock(lock_.descriptor, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK)
        refuse(path_, "another run is writing there");
}

void OutputFolder::move_aside(const fs::path& restart) {
    const fs::path whole = fs::canonical(path_);
    if (lies_in(fs::current_path(), whole))
        refuse(path_, "it holds an earlier run and cannot be moved aside, because it is or holds the current folder");
    if (!restart.empty() && lies_in(fs::weakly_canonical(restart), whole))
        refuse(path_, "it holds an earlier run, which would be moved aside together with the checkpoint to restart from");
    int number = 1;
    const auto numbered = [&] { return fs::path(fmt::format("{}.{}", path_.string(), number)); };
    while (fs::exists(fs::symlink_status(numbered())))
        ++number;
    fs::rename(path_, numbered());
    moved_to_ = numbered();
    lock_.release();
}

} // namespace ductile::io
