#include <ductile/base/error.hpp>
#include <ductile/base/threads.hpp>

#include <fmt/format.h>
#include <omp.h>

namespace ductile {

void set_thread_count(int count) {
    if (count < 1 || count > 4096)
        throw InputError(fmt::format("--threads {}: the number of threads must lie between 1 and 4096", count));
    omp_set_dynamic(0);
    omp_set_num_threads(count);
}

int thread_count() { return omp_get_max_threads(); }

} // namespace ductile
