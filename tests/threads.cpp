// SPDX-License-Identifier: GPL-3.0-or-later
// The team of threads: every task once, whoever does it; exceptions, calls within calls, two callers, and no work while waiting.
#include <ductile/base/error.hpp>
#include <ductile/base/processors.hpp>
#include <ductile/base/threads.hpp>

#include <doctest/doctest.h>

#include <atomic>
#include <chrono>
#include <cstdlib>
#include <ctime>
#include <functional>
#include <mutex>
#include <sched.h>
#include <set>
#include <string>
#include <thread>
#include <vector>

namespace threads_suite {

using namespace ductile;

namespace {

/// Sets the number of threads, for loops of any length, as long as it lives.
struct Threads {
    explicit Threads(int count) { set_thread_count(count, 0); }
    ~Threads() { set_thread_count(before); }
    Threads(const Threads&) = delete;
    Threads& operator=(const Threads&) = delete;
    int before = thread_count();
};

/// How often each of `tasks` tasks was called.
std::vector<int> calls(int tasks) {
    std::vector<std::atomic<int>> count(static_cast<std::size_t>(tasks));
    for_each_task(tasks, [&](int k) { ++count[static_cast<std::size_t>(k)]; });
    return {count.begin(), count.end()};
}

std::string thrown_by(const std::function<void()>& action) {
    try {
        action();
    } catch (const RunError& error) {
        return error.what();
    }
    return "nothing";
}

} // namespace

TEST_SUITE_BEGIN("threads");

TEST_CASE("every task is done once, on any number of threads") {
    for (const int threads : {1, 2, 3, 8}) {
        const Threads team(threads);
        for (int repetition = 0; repetition < 200; ++repetition)
            for (const int tasks : {0, 1, 2, 7, 64})
                REQUIRE(calls(tasks) == std::vector<int>(static_cast<std::size_t>(tasks), 1));
    }
}

TEST_CASE("what lies between two rows comes once, after both") {
    for (const int threads : {1, 2, 3, 8}) {
        const Threads team(threads);
        for (int repetition = 0; repetition < 100; ++repetition)
            for (const int rows : {1, 2, 5, 37}) {
                std::vector<std::atomic<int>> visited(static_cast<std::size_t>(rows)), joined(visited.size());
                std::atomic<int> too_early = 0;
                const long long sum = sweep_rows(
                    Rows{rows, 3}, 0LL,
                    [&](int j, long long& part) {
                        ++visited[static_cast<std::size_t>(j)];
                        part += j;
                    },
                    [&](int j) {
                        const auto upper = static_cast<std::size_t>(j);
                        too_early += visited[upper] == 1 && visited[upper - 1] == 1 ? 0 : 1;
                        ++joined[upper];
                    },
                    [](long long& total, long long part) { total += part; });
                REQUIRE(sum == rows * (rows - 1) / 2);
                REQUIRE(too_early == 0);
                for (std::size_t j = 0; j < visited.size(); ++j) {
                    REQUIRE(visited[j] == 1);
                    REQUIRE(joined[j] == (j > 0 ? 1 : 0));
                }
            }
    }
}

TEST_CASE("the exception of the first task that fails reaches the caller, and the team goes on") {
    for (const int threads : {1, 2, 3, 8}) {
        const Threads team(threads);
        for (int repetition = 0; repetition < 50; ++repetition) {
            CHECK(thrown_by([] {
                      for_each_task(40, [](int k) {
                          if (k % 10 == 7)
                              throw RunError("task " + std::to_string(k));
                      });
                  }) == "task 7");
            CHECK(calls(9) == std::vector<int>(9, 1));
        }
    }
}

TEST_CASE("a call from within a task and a second caller do their tasks themselves") {
    const Threads team(3);
    std::atomic<int> inner = 0;
    for_each_task(5, [&](int) { for_each_task(7, [&](int) { ++inner; }); });
    CHECK(inner == 35);

    std::atomic<int> wrong = 0;
    const auto work = [&] {
        for (int repetition = 0; repetition < 2000; ++repetition)
            wrong += calls(6) == std::vector<int>(6, 1) ? 0 : 1;
    };
    std::thread other(work);
    work();
    other.join();
    CHECK(wrong == 0);
}

TEST_CASE("short loops stay on the thread of their caller") {
    std::mutex lock;
    std::set<std::thread::id> seen;
    const auto visit = [&](int) {
        const std::lock_guard guard(lock);
        seen.insert(std::this_thread::get_id());
    };
    const int before = thread_count();
    set_thread_count(4);
    for (int repetition = 0; repetition < 100; ++repetition)
        for_each_row({63, 63}, visit);
    CHECK(seen == std::set{std::this_thread::get_id()});
    CHECK(threads_worth(3999) == 1);
    CHECK(threads_worth(4000) == 4);
    set_thread_count(before);
}

TEST_CASE("threads that wait for work use no processor") {
    const Threads team(2);
    (void)calls(64);
    bool idle = false; // at last: on a busy machine it may take a while until they sleep
    for (int interval = 0; interval < 100 && !idle; ++interval) {
        const std::clock_t start = std::clock(); // of all threads
        std::this_thread::sleep_for(std::chrono::milliseconds(100));
        idle = static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC < 0.02;
    }
    CHECK(idle);
}

TEST_CASE("the processors of this process are those it may use") {
    const char* const text = std::getenv("OMP_NUM_THREADS");
    const std::string kept = text != nullptr ? text : "";
    unsetenv("OMP_NUM_THREADS");
    const int all = available_processors();
    CHECK(all >= 1);
    CHECK(all <= static_cast<int>(std::thread::hardware_concurrency()));
    setenv("OMP_NUM_THREADS", "1,2", 1);
    CHECK(available_processors() == 1);
    for (const char* nonsense : {"many", "0", "-3", "", "4096"}) {
        setenv("OMP_NUM_THREADS", nonsense, 1);
        CHECK(available_processors() == all);
    }
    unsetenv("OMP_NUM_THREADS");
    std::thread([] { // the affinity is the thread's own
        cpu_set_t now, one;
        sched_getaffinity(0, sizeof now, &now);
        CPU_ZERO(&one);
        for (int processor = 0; processor < CPU_SETSIZE && CPU_COUNT(&one) == 0; ++processor)
            if (CPU_ISSET(processor, &now))
                CPU_SET(processor, &one);
        sched_setaffinity(0, sizeof one, &one);
        CHECK(available_processors() == 1);
    })
        .join();
    if (text != nullptr)
        setenv("OMP_NUM_THREADS", kept.c_str(), 1);
}

TEST_CASE("impossible numbers of threads are refused") {
    for (const int count : {0, -1, 4097})
        CHECK_THROWS_AS(set_thread_count(count), InputError);
}

TEST_SUITE_END();

} // namespace threads_suite
