// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/io/output_times.hpp>

#include <doctest/doctest.h>

namespace output_times_suite {

using namespace ductile::io;
using Times = std::vector<double>;

TEST_SUITE_BEGIN("output_times");

TEST_CASE("a run stops at its snapshots and its end, each once, in order") {
    const OutputTimes times(2.0, Times{1.5, 0.0, 0.5, 1.5, 3.0}, {});
    CHECK(times.after(0.0) == Times{2.0, 1.5, 0.5});
    CHECK(times.after(0.5) == Times{2.0, 1.5});
    CHECK(times.after(2.0).empty());
    for (const double t : {0.0, 0.5, 1.5})
        CHECK(times.is_snapshot(t));
    CHECK_FALSE(times.is_snapshot(2.0));
    CHECK_FALSE(times.is_snapshot(3.0));
}

TEST_CASE("times that differ by round-off are one: no snapshot is lost, no step is of that length") {
    for (const double end : {0.3, 0.1 * 3.0})
        for (const double snapshot : {0.3, 0.1 * 3.0}) {
            const OutputTimes times(end, Times{snapshot}, {});
            CHECK(times.is_snapshot(end));
            CHECK(times.after(0.0) == Times{end});
            CHECK(times.after(snapshot).empty());
            CHECK(missing_snapshots(end, Times{snapshot}).empty());
        }
    const OutputTimes times(1.0, Times{0.3, 0.1 * 3.0}, {});
    CHECK(times.after(0.0).size() == 2);
}

TEST_CASE("rows have times of their own; where one is that of a snapshot up to round-off it is that very time") {
    const OutputTimes times(1.0, Times{0.3, 0.5}, Times{0.0, 0.1 * 3.0, 0.6, 1.0});
    CHECK(times.after(0.0) == Times{1.0, 0.6, 0.5, times.after(0.0)[3]});
    const double both = times.after(0.0)[3];
    CHECK(times.is_snapshot(both));
    CHECK(times.is_row(both));
    CHECK(times.is_row(1.0));
    CHECK_FALSE(times.is_snapshot(1.0));
    CHECK_FALSE(times.is_row(0.5));
    CHECK_FALSE(times.is_snapshot(0.6));
}

TEST_CASE("snapshots that nobody asked for end with the run") {
    const Times paper{0.0, 0.46575, 0.9315, 1.4175};
    CHECK(snapshots_of_run(1.4175, paper) == paper);
    CHECK(snapshots_of_run(1.0, paper) == Times{0.0, 0.46575, 0.9315, 1.0});
    CHECK(snapshots_of_run(3.0, paper) == Times{0.0, 0.46575, 0.9315, 1.4175, 3.0});
    CHECK(snapshots_of_run(3.0, {}).empty());
}

TEST_CASE("snapshots beyond the end are announced as missing") {
    CHECK(missing_snapshots(1.0, Times{}).empty());
    CHECK(missing_snapshots(1.0, Times{0.5, 1.0}).empty());
    const auto warnings = missing_snapshots(1.0, Times{0.5, 1.5, 1.2});
    REQUIRE(warnings.size() == 1);
    CHECK(warnings[0] == "the snapshot at 1.5 s lies beyond the end at 1 s and will be missing: lengthen --duration");
}

TEST_SUITE_END();

} // namespace output_times_suite
