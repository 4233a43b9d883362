// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/io/interrupt.hpp>

#include <algorithm>
#include <array>
#include <csignal>
#include <signal.h>

namespace ductile::io {
namespace {

volatile std::sig_atomic_t signal_seen = 0;

void remember(int) { signal_seen = 1; }

bool ignored(int number) {
    struct sigaction now {};
    return sigaction(number, nullptr, &now) == 0 && (now.sa_flags & SA_SIGINFO) == 0 && now.sa_handler == SIG_IGN;
}

void handle(int number) {
    constexpr std::array ignored_by_routine = {SIGINT, SIGQUIT, SIGPIPE};
    constexpr std::array repeated = {SIGPIPE, SIGXCPU};
    if (ignored(number) && std::ranges::find(ignored_by_routine, number) == ignored_by_routine.end())
        return;
    struct sigaction action {};
    action.sa_handler = remember;
    sigemptyset(&action.sa_mask);
    action.sa_flags = static_cast<int>(SA_RESTART);
    // After the first signal the default action is back, so a second one kills a run that does not come to its end.
    if (std::ranges::find(repeated, number) == repeated.end())
        action.sa_flags |= static_cast<int>(SA_RESETHAND);
    sigaction(number, &action, nullptr);
}

} // namespace

void install_signal_handlers() {
    signal_seen = 0;
    for (const int number : {SIGINT, SIGTERM, SIGHUP, SIGQUIT, SIGUSR1, SIGUSR2, SIGXCPU, SIGALRM, SIGVTALRM, SIGPROF, SIGIO,
                             SIGPWR, SIGSTKFLT, SIGPIPE})
        handle(number);
    for (int number = SIGRTMIN; number <= SIGRTMAX; ++number)
        handle(number);
    std::signal(SIGXFSZ, SIG_IGN);
}

bool interrupted() noexcept { return signal_seen != 0; }

} // namespace ductile::io
