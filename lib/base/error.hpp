// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <stdexcept>
#include <string>

namespace ductile {

/// The one family of exceptions. A message says what was wrong, where, and what to change.
class Error : public std::runtime_error {
public:
    /// The exit status a program ends with when this error reaches its main function.
    [[nodiscard]] int exit_status() const noexcept { return exit_status_; }

protected:
    Error(const std::string& message, int exit_status) : std::runtime_error(message), exit_status_(exit_status) {}

private:
    int exit_status_;
};

/// The user asked for something impossible: an option, a configuration or an input file is wrong. Exit status 2.
class InputError : public Error {
public:
    explicit InputError(const std::string& message) : Error(message, 2) {}
};

/// A run that began correctly could not go on: a non-finite value, a full disk, a solver that failed. Exit status 1.
class RunError : public Error {
public:
    explicit RunError(const std::string& message) : Error(message, 1) {}
};

} // namespace ductile
