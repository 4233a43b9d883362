#include <ductile/io/interrupt.hpp>

#include <csignal>
#include <signal.h>

namespace ductile::io {
namespace {

volatile std::sig_atomic_t signal_seen = 0;

void remember(int) { signal_seen = 1; }

} // namespace

void install_signal_handlers() {
    signal_seen = 0;
    struct sigaction once {};
    once.sa_handler = remember;
    // After the first signal the default action is back, so a second one kills a run that does not come to its end.
    once.sa_flags = static_cast<int>(SA_RESETHAND | SA_RESTART);
    sigemptyset(&once.sa_mask);
    sigaction(SIGINT, &once, nullptr);
    sigaction(SIGTERM, &once, nullptr);
    std::signal(SIGXFSZ, SIG_IGN);
}

bool interrupted() noexcept { return signal_seen != 0; }

} // namespace ductile::io
