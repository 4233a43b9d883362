#include <ductile/base/error.hpp>
#include <ductile/space/grid.hpp>

#include <fmt/format.h>

int main() {
    ductile::Grid grid{.cells_x = 10, .cells_y = 5};
    ductile::check(grid);
    fmt::print("dx = {}, dy = {}\n", grid.dx(), grid.dy());

    grid.cells_x = 1;
    try {
        ductile::check(grid);
    } catch (const ductile::InputError& error) {
        fmt::print("refused with status {}\n", error.exit_status());
        return 0;
    }
    return 1;
}
