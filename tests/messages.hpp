// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/base/error.hpp>

#include <string>

/// What an action says when it throws an error of this type; "nothing was thrown" if it succeeds.
template <class E = ductile::Error> std::string message_of(const auto& action) {
    try {
        action();
    } catch (const E& error) {
        return error.what();
    }
    return "nothing was thrown";
}

inline bool contains(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }
