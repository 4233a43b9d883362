#pragma once

namespace ductile {

/// Number of threads that parallel regions use. Throws InputError for a count below 1 or above 4096.
void set_thread_count(int count);
[[nodiscard]] int thread_count();

/// The rows [begin, end) that one thread of a team works on.
struct RowRange {
    int begin = 0;
    int end = 0;
};

/// Contiguous share of `rows` rows for thread `thread` of `team`; shares differ by at most one row.
[[nodiscard]] constexpr RowRange share_of_rows(int rows, int thread, int team) {
    const auto cut = [&](int t) { return static_cast<int>(static_cast<long long>(rows) * t / team); };
    return {cut(thread), cut(thread + 1)};
}

} // namespace ductile
