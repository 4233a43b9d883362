// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/base/error.hpp>
#include <ductile/io/atomic_file.hpp>

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <fcntl.h>
#include <unistd.h>
#include <utility>

namespace ductile::io {
namespace {

[[noreturn]] void fail(const std::filesystem::path& path, const char* action) {
    throw RunError(fmt::format("{}: cannot {} the file ({}): check free space and whether the folder is still there",
                               path.string(), action, std::strerror(errno)));
}

/// Closes a file descriptor when left early.
struct Descriptor {
    int number;
    ~Descriptor() {
        if (number >= 0)
            ::close(number);
    }
};

void bring_to_disk(const std::filesystem::path& path) {
    const Descriptor file{::open(path.c_str(), O_RDONLY | O_CLOEXEC)};
    if (file.number < 0 || ::fsync(file.number) != 0)
        fail(path, "bring to the disk");
}

} // namespace

void rename_durably(const std::filesystem::path& from, const std::filesystem::path& to) {
    bring_to_disk(from);
    if (std::rename(from.c_str(), to.c_str()) != 0)
        fail(to, "put in place");
    // The name itself is data of the folder. Some file systems cannot sync folders: the file is then as safe as it gets.
    const std::filesystem::path folder = to.has_parent_path() ? to.parent_path() : ".";
    const Descriptor opened{::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC)};
    if (opened.number >= 0)
        ::fsync(opened.number);
}

AtomicFile::AtomicFile(std::filesystem::path final_path) : final_(std::move(final_path)), temporary_(final_) {
    temporary_ += ".tmp";
}

AtomicFile::~AtomicFile() {
    std::error_code ignored;
    if (!committed_)
        std::filesystem::remove(temporary_, ignored);
}

void AtomicFile::commit() {
    rename_durably(temporary_, final_);
    committed_ = true;
}

void copy_beginning(const std::filesystem::path& from, const std::filesystem::path& to, std::uint64_t bytes) {
    std::error_code failure;
    std::filesystem::copy_file(from, to, std::filesystem::copy_options::overwrite_existing, failure);
    if (!failure)
        std::filesystem::resize_file(to, bytes, failure);
    if (failure)
        throw RunError(
            fmt::format("{}: cannot copy it to {} ({}): check free space", from.string(), to.string(), failure.message()));
}

void write_text_atomically(const std::filesystem::path& path, std::string_view text) {
    AtomicFile target(path);
    {
        const Descriptor file{::open(target.temporary_path().c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666)};
        if (file.number < 0)
            fail(path, "create");
        while (!text.empty()) {
            const ssize_t written = ::write(file.number, text.data(), text.size());
            if (written < 0 && errno != EINTR)
                fail(path, "write");
            text.remove_prefix(static_cast<std::size_t>(std::max<ssize_t>(written, 0)));
        }
    }
    target.commit();
}

} // namespace ductile::io
