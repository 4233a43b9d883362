#pragma once

namespace ductile::io {

/// Exit status of a run that a signal ended in good order.
inline constexpr int interrupted_exit_status = 130;

/// From now on SIGINT and SIGTERM only set a flag; the second signal of a kind kills. A file-size limit becomes an error of
/// the write instead of a signal. Clears the flag.
void install_signal_handlers();

/// True once a signal asked the run to end: write a checkpoint and return.
[[nodiscard]] bool interrupted() noexcept;

} // namespace ductile::io
