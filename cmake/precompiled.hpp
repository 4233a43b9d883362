// SPDX-License-Identifier: GPL-3.0-or-later
// What most files include anyway, compiled once. No file relies on it: builds with CMAKE_DISABLE_PRECOMPILE_HEADERS=ON see their
// own includes alone.
#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <experimental/simd>
#include <filesystem>
#include <fmt/format.h>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <numeric>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>
