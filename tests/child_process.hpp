// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include "io_scratch.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/wait.h>

#include <string>
#include <vector>

namespace scratch {

using Arguments = std::vector<std::string>;

inline Arguments operator+(Arguments first, const Arguments& second) {
    first.insert(first.end(), second.begin(), second.end());
    return first;
}

/// The command line of a program of this build.
inline Arguments command(const std::string& program, const Arguments& arguments) {
    return Arguments{fmt::format("{}/{}", DUCTILE_PROGRAMS, program)} + arguments;
}

/// A program run as users run it: its exit status (128 + signal if one killed it) and what it printed.
class ChildProcess {
public:
    /// Starts it; `largest_file` is the size no file of it may exceed.
    explicit ChildProcess(std::vector<std::string> command, rlim_t largest_file = RLIM_INFINITY) {
        std::vector<char*> argv;
        for (std::string& word : command)
            argv.push_back(word.data());
        argv.push_back(nullptr);
        const std::string out = folder_ / "out", error = folder_ / "error";
        id_ = fork();
        if (id_ != 0)
            return;
        for (const auto& [file, stream] : {std::pair{&out, STDOUT_FILENO}, std::pair{&error, STDERR_FILENO}})
            dup2(open(file->c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600), stream);
        const rlimit limit{largest_file, RLIM_INFINITY};
        if (largest_file != RLIM_INFINITY)
            setrlimit(RLIMIT_FSIZE, &limit);
        execv(argv.front(), argv.data());
        _exit(127);
    }
    ~ChildProcess() {
        if (id_ > 0)
            kill(id_, SIGKILL), wait();
    }
    ChildProcess(const ChildProcess&) = delete;
    ChildProcess& operator=(const ChildProcess&) = delete;

    void signal(int number) const { kill(id_, number); }
    int wait() {
        int status = 0;
        if (id_ > 0) {
            waitpid(id_, &status, 0);
            status_ = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
            id_ = -1;
        }
        return status_;
    }
    [[nodiscard]] std::string output() const { return read(folder_ / "out"); }
    [[nodiscard]] std::string errors() const { return read(folder_ / "error"); }

private:
    Folder folder_;
    pid_t id_ = -1;
    int status_ = -1;
};

struct Outcome {
    int status;
    std::string output, errors;
};

/// A program of this build, run to its end.
inline Outcome run(const std::string& program, const Arguments& arguments, rlim_t largest_file = RLIM_INFINITY) {
    ChildProcess process(command(program, arguments), largest_file);
    const int status = process.wait();
    return {status, process.output(), process.errors()};
}

} // namespace scratch
