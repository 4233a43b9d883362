// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <doctest/doctest.h>

/// CAPTURE of a structured binding, which clang++ before 16 does not let into the lambda that CAPTURE is.
#define CAPTURE_BINDING(name)                                                                                                    \
    const auto& bound_##name = name;                                                                                             \
    CAPTURE(bound_##name)
