#include <ductile/base/error.hpp>
#include <ductile/quasistatic/walls.hpp>

#include <charconv>
#include <fmt/format.h>
#include <string>
#include <vector>

namespace ductile::quasistatic {

WallHistory parse_wall_history(std::string_view text) {
    const auto fail = [&](std::string_view part) {
        return InputError(
            fmt::format("--wall-history: cannot read '{}' in '{}': give knots time:u or time:u:v in s and m/s, separated "
                        "by commas, e.g. 0:5e-4,0.7:5e-4,0.7:-5e-4",
                        part, text));
    };
    std::vector<WallKnot> knots;
    std::string_view rest = text;
    for (bool more = !text.empty(); more;) { // a knot follows every comma
        const auto comma = rest.find(',');
        const std::string_view part = rest.substr(0, comma);
        more = comma != std::string_view::npos;
        if (more)
            rest.remove_prefix(comma + 1);
        double values[3] = {0.0, 0.0, 0.0};
        int count = 0;
        const char* cursor = part.data();
        const char* const end = part.data() + part.size();
        while (count < 3) {
            const auto [stop, status] = std::from_chars(cursor, end, values[count]);
            if (status != std::errc{})
                throw fail(part);
            ++count;
            cursor = stop;
            if (cursor == end || *cursor != ':')
                break;
            ++cursor;
        }
        if (cursor != end || count < 2)
            throw fail(part);
        knots.push_back({values[0], {values[1], values[2]}});
    }
    try {
        return WallHistory(std::move(knots));
    } catch (const InputError& error) {
        throw InputError(fmt::format("--wall-history: {}", error.what()));
    }
}

} // namespace ductile::quasistatic
