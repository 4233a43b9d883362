// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/base/error.hpp>
#include <ductile/base/processors.hpp>
#include <ductile/base/threads.hpp>

#include <array>
#include <chrono>
#include <cstdint>
#include <exception>
#include <fmt/format.h>
#include <limits>
#include <mutex>
#include <signal.h>
#include <system_error>
#include <thread>
#include <utility>

namespace ductile {
namespace {

using Clock = std::chrono::steady_clock;

constexpr int most_threads = 4096;
constexpr auto spinning_time = std::chrono::microseconds(30); // about what it costs to sleep and be woken
/// After a wait for somebody who has lost his processor the team's caller works alone for this many times as long.
constexpr int times_alone = 8;

void relax() {
#if defined(__x86_64__) || defined(__i386__)
    __builtin_ia32_pause();
#elif defined(__aarch64__)
    asm volatile("yield");
#endif
}

/// Waits until `ready()`, but not for long; says whether it is.
bool spin_until(const auto& ready) {
    const auto end = Clock::now() + spinning_time;
    do {
        for (int i = 0; i < 16; ++i) {
            if (ready())
                return true;
            relax();
        }
    } while (Clock::now() < end);
    return false;
}

/// The tasks of one member that nobody has begun. The owner takes them from the front, others from the back.
class alignas(64) Share {
public:
    void set(RowRange tasks) { tasks_.store(packed(tasks), std::memory_order_release); }
    /// The number of a task that is now the caller's, or -1.
    int take(bool front) {
        std::uint64_t now = tasks_.load(std::memory_order_relaxed);
        while (true) {
            RowRange tasks{static_cast<int>(now >> 32U), static_cast<int>(now & 0xffffffffU)};
            if (tasks.begin >= tasks.end)
                return -1;
            const int taken = front ? tasks.begin++ : --tasks.end;
            if (tasks_.compare_exchange_weak(now, packed(tasks), std::memory_order_acquire, std::memory_order_relaxed))
                return taken;
        }
    }

private:
    static std::uint64_t packed(RowRange tasks) {
        return static_cast<std::uint64_t>(tasks.begin) << 32U | static_cast<std::uint64_t>(tasks.end);
    }
    std::atomic<std::uint64_t> tasks_ = 0;
};

/// Whoever has taken a task may read what the job is: it cannot end before the task has.
class Team {
public:
    /// All tasks, or none if the team is at work or had better not be called.
    bool run(int threads, int tasks, const void* task, void (*call)(const void*, int)) {
        if (at_work_.exchange(true, std::memory_order_acquire))
            return false;
        const auto start = Clock::now();
        if (start < alone_until_) {
            at_work_.store(false, std::memory_order_release);
            return false;
        }
        provide_workers(threads - 1);
        task_ = task;
        call_ = call;
        error_ = nullptr;
        failed_.store(std::numeric_limits<int>::max(), std::memory_order_relaxed);
        unfinished_.store(tasks, std::memory_order_relaxed);
        const int members = std::min(threads, tasks);
        members_.store(members, std::memory_order_relaxed);
        for (int m = 0; m < members; ++m)
            shares_[static_cast<std::size_t>(m)].set(share_of_rows(tasks, m, members));
        jobs_.fetch_add(1, std::memory_order_release);
        jobs_.notify_all();

        (void)work(0);
        const auto done = Clock::now();
        const auto finished = [&] { return unfinished_.load(std::memory_order_acquire) == 0; };
        if (!spin_until(finished)) {
            // One look both ends the wait and is waited on: after a second one, of a zero, nobody would wake who sleeps.
            for (int left = unfinished_.load(std::memory_order_acquire); left != 0;
                 left = unfinished_.load(std::memory_order_acquire))
                unfinished_.wait(left, std::memory_order_acquire);
            const auto end = Clock::now();
            if (end - done > std::max<Clock::duration>(done - start, 4 * spinning_time))
                alone_until_ = end + times_alone * (end - done);
        }
        const std::exception_ptr error = std::exchange(error_, nullptr);
        at_work_.store(false, std::memory_order_release);
        if (error)
            std::rethrow_exception(error);
        return true;
    }

private:
    /// Says whether there was anything left to do.
    bool work(int member) {
        bool worked = false;
        const int members = members_.load(std::memory_order_relaxed);
        for (int k = 0; k < members; ++k) {
            Share& share = shares_[static_cast<std::size_t>((member + k) % members)];
            for (int number = share.take(k == 0); number >= 0; number = share.take(k == 0)) {
                execute(number);
                worked = true;
            }
        }
        return worked;
    }

    void execute(int number) {
        try {
            if (number < failed_.load(std::memory_order_relaxed))
                call_(task_, number);
        } catch (...) {
            const std::lock_guard lock(failure_);
            if (number < failed_.load(std::memory_order_relaxed)) {
                failed_.store(number, std::memory_order_relaxed);
                error_ = std::current_exception();
            }
        }
        if (unfinished_.fetch_sub(1, std::memory_order_acq_rel) == 1)
            unfinished_.notify_one();
    }

    /// The life of a worker: it ends with the process. One that has come too late some times in a row shares its processor with
    /// others, perhaps with the caller, and seldom spins.
    [[noreturn]] void serve(int member) {
        std::uint32_t seen = 0;
        unsigned late = 0;
        while (true) {
            const auto called = [&] { return jobs_.load(std::memory_order_acquire) != seen; };
            const bool spins = member < thread_count() && (late < 3 || late % 16 == 0);
            if (!spins || !spin_until(called))
                jobs_.wait(seen, std::memory_order_acquire);
            seen = jobs_.load(std::memory_order_acquire);
            if (member < thread_count())
                late = work(member) ? 0 : late + 1;
        }
    }

    /// Where no more threads can be had those that are there must do.
    void provide_workers(int count) {
        if (workers_ >= count || exhausted_)
            return;
        // Signals that ask the process for something are the main thread's.
        sigset_t all, before;
        sigfillset(&all);
        for (const int fault : {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGTRAP, SIGABRT, SIGSYS})
            sigdelset(&all, fault);
        pthread_sigmask(SIG_SETMASK, &all, &before);
        try {
            for (; workers_ < count; ++workers_)
                std::thread([this, member = workers_ + 1] { serve(member); }).detach();
        } catch (const std::system_error&) {
            exhausted_ = true;
        }
        pthread_sigmask(SIG_SETMASK, &before, nullptr);
    }

    std::atomic<bool> at_work_ = false;
    Clock::time_point alone_until_ = Clock::time_point::min();
    int workers_ = 0;
    bool exhausted_ = false;

    const void* task_ = nullptr;
    void (*call_)(const void*, int) = nullptr;
    std::mutex failure_;
    std::exception_ptr error_;
    std::atomic<int> failed_ = 0; // the smallest number of a task that threw

    std::atomic<int> members_ = 1;
    alignas(64) std::atomic<int> unfinished_ = 0;
    alignas(64) std::atomic<std::uint32_t> jobs_ = 0;
    std::array<Share, most_threads> shares_;
};

/// Never destroyed: its threads sleep until the process ends, however that happens.
Team& team() {
    static Team& only = *new Team;
    return only;
}

std::atomic<int> chosen_count = 0; // 0: none yet
std::atomic<long long> fewest = 4000;

} // namespace

void set_thread_count(int count, long long fewest_points) {
    if (count < 1 || count > most_threads)
        throw InputError(fmt::format("the number of threads must lie between 1 and {}, not be {}", most_threads, count));
    chosen_count.store(count, std::memory_order_relaxed);
    fewest.store(fewest_points, std::memory_order_relaxed);
}

int thread_count() {
    static const int standard = std::min(available_processors(), most_threads);
    const int chosen = chosen_count.load(std::memory_order_relaxed);
    return chosen > 0 ? chosen : standard;
}

int threads_worth(long long points) { return points < fewest.load(std::memory_order_relaxed) ? 1 : thread_count(); }

void run_tasks(int tasks, const void* task, void (*call)(const void*, int)) {
    const int threads = thread_count();
    if (threads > 1 && tasks > 1 && team().run(threads, tasks, task, call))
        return;
    for (int number = 0; number < tasks; ++number)
        call(task, number);
}

} // namespace ductile
