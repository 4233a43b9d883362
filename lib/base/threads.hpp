// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <algorithm>
#include <atomic>
#include <cstddef>
#include <vector>

/// The one place where work is shared out to threads.
///
/// A team works through numbered tasks. Its caller takes part and does whatever nobody else has taken: threads that sleep, or
/// wait for a busy processor, cost nothing but what they have begun. Each thread begins with a contiguous share of its own, the
/// same each time, and then helps the others. Threads wait for work for some microseconds, then sleep. Who does a task changes no
/// bit of a result as long as tasks write to places of their own, which is why there are no sums here but in a fixed order.
///
/// A call from within a task, or from a second thread while the team is at work, does all its tasks itself.
namespace ductile {

/// Number of threads, the caller's included; at first available_processors(). Loops over fewer cells or particles than
/// `fewest_points` stay on one: waking threads costs as much as some hundred of them. Throws InputError for a count below 1 or
/// above 4096.
void set_thread_count(int count, long long fewest_points = 4000);
[[nodiscard]] int thread_count();
/// How many of them a loop over so many cells or particles is worth: all or one.
[[nodiscard]] int threads_worth(long long points);

/// The rows [begin, end) of one task.
struct RowRange {
    int begin = 0;
    int end = 0;
};

/// Contiguous share `share` of `shares` of `rows` rows; shares differ by at most one row.
[[nodiscard]] constexpr RowRange share_of_rows(int rows, int share, int shares) {
    const auto cut = [&](int s) { return static_cast<int>(static_cast<long long>(rows) * s / shares); };
    return {cut(share), cut(share + 1)};
}

/// What for_each_task() comes down to.
void run_tasks(int tasks, const void* task, void (*call)(const void* task, int number));

/// Calls `task(k)` once for each k in [0, tasks), in no certain order, and returns when all are done. What the task of the
/// smallest number throws is thrown here; tasks above that may have been left out.
template <class Task> void for_each_task(int tasks, const Task& task) {
    run_tasks(tasks, &task, [](const void* t, int number) { (*static_cast<const Task*>(t))(number); });
}

/// `count` rows of `length` cells or nodes.
struct Rows {
    int count = 0;
    int length = 0;

    [[nodiscard]] int threads() const { return threads_worth(static_cast<long long>(count) * length); }
    /// The number of tasks they are cut into: some for each thread, so that one that comes late does less.
    [[nodiscard]] int shares() const {
        const int team = threads();
        return team == 1 ? 1 : std::min(count, 4 * team);
    }
};

/// Calls `visit(j)` for each row.
void for_each_row(Rows rows, const auto& visit) {
    const int shares = rows.shares();
    for_each_task(shares, [&](int share) {
        const auto [begin, end] = share_of_rows(rows.count, share, shares);
        for (int j = begin; j < end; ++j)
            visit(j);
    });
}

/// Calls `visit(j, part)` for each row and `between(j)` once the rows j - 1 and j have been visited. Each share of the rows has
/// its own `part`, at first a copy of `start`; returns `start` after `merge(total, part)` for each. The shares depend on the
/// number of threads: only what any order of merging gives the same bits (largest values, whole numbers) may be gathered so.
template <class Part>
[[nodiscard]] Part sweep_rows(Rows rows, const Part& start, const auto& visit, const auto& between, const auto& merge) {
    const int shares = rows.shares();
    if (shares == 1) {
        Part part = start;
        for (int j = 0; j < rows.count; ++j) {
            visit(j, part);
            if (j > 0)
                between(j);
        }
        Part total = start;
        merge(total, part);
        return total;
    }
    std::vector<Part> parts(static_cast<std::size_t>(shares), start);
    std::vector<std::atomic<bool>> one_side_done(static_cast<std::size_t>(shares) + 1);
    for_each_task(shares, [&](int share) {
        const auto s = static_cast<std::size_t>(share);
        const auto [begin, end] = share_of_rows(rows.count, share, shares);
        Part part = start;
        for (int j = begin; j < end; ++j) {
            visit(j, part);
            if (j > begin)
                between(j);
        }
        // whoever comes second to the border of two shares finds both its rows
        if (begin > 0 && one_side_done[s].exchange(true))
            between(begin);
        if (end < rows.count && one_side_done[s + 1].exchange(true))
            between(end);
        parts[s] = part;
    });
    Part total = start;
    for (const Part& part : parts)
        merge(total, part);
    return total;
}

/// The same without anything between rows.
template <class Part> [[nodiscard]] Part gather_rows(Rows rows, const Part& start, const auto& visit, const auto& merge) {
    return sweep_rows(
        rows, start, visit, [](int) {}, merge);
}

} // namespace ductile
