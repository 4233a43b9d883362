// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

namespace ductile::io {

/// Exit status of a run that a signal ended in good order.
inline constexpr int interrupted_exit_status = 130;

/// From now on every signal that asks the process to end only sets a flag: interrupt and quit of the terminal, hangup, terminate,
/// the warnings of batch systems (SIGUSR1, SIGUSR2, SIGXCPU), timers, power failure, real-time signals, and the end of whoever
/// reads the output (SIGPIPE). The second of a kind kills, but for SIGPIPE and SIGXCPU, which come again by themselves. Those
/// that the process was told to ignore when it began (nohup: SIGHUP) stay ignored, except SIGINT, SIGQUIT and SIGPIPE, which
/// shells and parents ignore as a matter of routine. Crashes are nobody's wish and stay as they are. A file-size limit becomes an
/// error of the write instead of a signal. Clears the flag.
void install_signal_handlers();

/// True once a signal asked the run to end: write a checkpoint and return.
[[nodiscard]] bool interrupted() noexcept;

} // namespace ductile::io
