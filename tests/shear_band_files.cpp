// SPDX-License-Identifier: GPL-3.0-or-later
// Every column of history.csv and every field of fields.h5 that shear_band writes, against values worked out here from the
// stress components alone.
#include "child_process.hpp"
#include "messages.hpp"

#include <ductile/io/hdf5.hpp>

#include <doctest/doctest.h>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <map>
#include <sstream>
#include <string>
#include <vector>

namespace shear_band_files_suite {

using namespace ductile;
using scratch::Arguments;
using scratch::operator+;
namespace fs = std::filesystem;

namespace {

constexpr int cells_x = 12, cells_y = 10;
constexpr double width = 0.03, height = 0.02, yield_stress = 0.85e9;

/// Columns of history.csv by their names.
std::map<std::string, std::vector<double>> history_in(const fs::path& folder) {
    std::istringstream text(scratch::read(folder / "history.csv"));
    std::string line, word;
    std::getline(text, line);
    std::vector<std::string> names;
    for (std::istringstream head(line); std::getline(head, word, ',');)
        names.push_back(word);
    std::map<std::string, std::vector<double>> columns;
    while (std::getline(text, line)) {
        std::istringstream row(line);
        for (const std::string& name : names) {
            std::getline(row, word, ',');
            columns[name].push_back(std::stod(word));
        }
    }
    return columns;
}

struct Snapshot {
    double time = 0.0;
    std::int64_t step = 0;
    std::map<std::string, std::vector<double>> fields = {};
    std::map<std::string, std::string> units = {};
};

std::vector<Snapshot> snapshots_in(const fs::path& folder) {
    const io::Hdf5File file = io::Hdf5File::open(folder / "fields.h5");
    std::vector<Snapshot> all;
    for (const std::string& name : file.members("snapshots")) {
        const std::string group = "snapshots/" + name;
        Snapshot& snapshot = all.emplace_back(
            Snapshot{.time = file.double_attribute(group, "time_s"), .step = file.integer_attribute(group, "step")});
        for (const std::string& field : file.members(group)) {
            const auto shape = file.shape(group + "/" + field);
            std::vector<double>& values = snapshot.fields[field];
            values.resize(shape[0] * shape[1]);
            file.read(group + "/" + field,
                      {values.data(), static_cast<int>(shape[0]), static_cast<int>(shape[1]), static_cast<int>(shape[1])});
            snapshot.units[field] = file.text_attribute(group + "/" + field, "units");
        }
    }
    return all;
}

nlohmann::json summary_in(const fs::path& folder) { return nlohmann::json::parse(scratch::read(folder / "summary.json")); }

/// Runs shear_band on the small rectangle; it must complete.
void run_well(const fs::path& folder, const Arguments& arguments) {
    const scratch::Outcome outcome = scratch::run(
        "shear_band",
        Arguments{"--cells", "12x10", "--width", "0.03", "--threads", "1", "--quiet", "--output", folder.string()} + arguments);
    CAPTURE(outcome.errors);
    REQUIRE(outcome.status == 0);
}

double mean(const std::vector<double>& values) {
    double sum = 0.0;
    for (const double value : values)
        sum += value;
    return sum / static_cast<double>(values.size());
}

/// max |integral of sigma : grad psi| over interior corners, psi with the one-point gradient, over (largest component times the
/// longer side), worked out corner by corner.
double residual_of(const Snapshot& s, double dx, double dy) {
    const auto at = [&](const char* field, int i, int j) {
        return s.fields.at(field)[static_cast<std::size_t>(j * cells_x + (i + cells_x) % cells_x)];
    };
    const auto xx = [&](int i, int j) { return -at("pressure", i, j) + at("s", i, j) - at("q", i, j); };
    const auto yy = [&](int i, int j) { return -at("pressure", i, j) - at("s", i, j) - at("q", i, j); };
    const auto xy = [&](int i, int j) { return at("tau", i, j); };
    double force = 0.0, stress = 0.0;
    for (int j = 0; j < cells_y; ++j)
        for (int i = 0; i < cells_x; ++i) {
            stress = std::max({stress, std::abs(xx(i, j)), std::abs(yy(i, j)), std::abs(xy(i, j))});
            if (j == 0)
                continue;
            double fx = 0.0, fy = 0.0;
            for (const int right : {0, 1})
                for (const int up : {0, 1}) { // the cells around corner (i, j)
                    const int ci = i - 1 + right, cj = j - 1 + up;
                    const double gx = (right == 1 ? -0.5 : 0.5) * dy, gy = (up == 1 ? -0.5 : 0.5) * dx; // area times grad psi
                    fx += xx(ci, cj) * gx + xy(ci, cj) * gy;
                    fy += xy(ci, cj) * gx + yy(ci, cj) * gy;
                }
            force = std::max({force, std::abs(fx), std::abs(fy)});
        }
    return force / (stress * std::max(dx, dy));
}

/// The strain of walls that move with (u, v) from 0 on, and (u', v') from `jump` on.
struct Loading {
    double u, v, jump, after_u, after_v;
    [[nodiscard]] double strain(double t) const { // of the gap between walls that move oppositely
        return (u * std::min(t, jump) + after_u * std::max(t - jump, 0.0)) / (0.5 * height);
    }
    [[nodiscard]] double opening(double t) const { return Loading{v, 0.0, jump, after_v, 0.0}.strain(t); }
};

void check_files(const fs::path& folder, const Loading& load, const std::string& internal, const std::string& suffix,
                 double hardening = 0.0) {
    const auto history = history_in(folder);
    const auto snapshots = snapshots_in(folder);
    REQUIRE(history.size() == 22);
    REQUIRE(snapshots.size() == 3);
    const std::vector<double>& time = history.at("time_s");
    for (std::size_t k = 0; k < time.size(); ++k) {
        CHECK(history.at("wall_strain")[k] == doctest::Approx(load.strain(time[k])).epsilon(1e-12));
        CHECK(history.at("wall_opening_strain")[k] == doctest::Approx(load.opening(time[k])).epsilon(1e-12));
        CHECK(history.at("step")[k] == static_cast<double>(k));
        for (const char* column : {"unresolved_x", "unresolved_y"}) {
            CHECK(history.at(column)[k] >= 0.0);
            CHECK(history.at(column)[k] < 0.2);
        }
        CHECK(history.at("dt_s")[k] == doctest::Approx(k == 0 ? 0.0 : time[k] - time[k - 1]).epsilon(1e-9));
        CHECK(history.at("energy_error_J")[k] ==
              doctest::Approx(history.at("elastic_energy_J")[k] - history.at("wall_work_J")[k] +
                              history.at("plastic_dissipation_J")[k])
                  .epsilon(1e-9)
                  .scale(1e-3));
    }
    // the work of the walls from the tractions of the rows, by the trapezoidal rule
    double work = 0.0;
    for (std::size_t k = 1; k < time.size(); ++k)
        for (const auto& [strain, traction] :
             {std::pair{"wall_strain", "wall_shear_traction_Pa"}, std::pair{"wall_opening_strain", "wall_normal_traction_Pa"}})
            work += 0.5 * (history.at(traction)[k] + history.at(traction)[k - 1]) *
                    (history.at(strain)[k] - history.at(strain)[k - 1]) * width * height;
    CHECK(history.at("wall_work_J").back() == doctest::Approx(work).epsilon(2e-3));
    CHECK(history.at("plastic_dissipation_J").back() > 0.05 * work);
    CHECK(std::abs(history.at("energy_error_J").back()) < 2e-3 * work);
    CHECK((history.at("transported_energy_J").back() != 0.0) == (hardening == 0.0)); // Perzyna starts uniform, and stays so
    for (const Snapshot& s : snapshots) {
        CAPTURE(s.time);
        const auto row = static_cast<std::size_t>(s.step);
        REQUIRE(row < time.size());
        const auto column = [&](const std::string& name) { return history.at(name)[row]; };
        CHECK(column("time_s") == doctest::Approx(s.time).epsilon(1e-14));

        std::vector<double> magnitude, yy;
        double energy = 0.0;
        double plastic = 0.0;
        for (std::size_t c = 0; c < cells_x * cells_y; ++c) {
            const double p = s.fields.at("pressure")[c], ss = s.fields.at("s")[c], tau = s.fields.at("tau")[c],
                         q = s.fields.at("q")[c];
            magnitude.push_back(std::hypot(ss, tau, std::sqrt(3.0) * q));
            yy.push_back(-p - ss - q);
            energy += 0.5 * (p * p / 122e9 + magnitude.back() * magnitude.back() / 37.4e9) * width * height / (cells_x * cells_y);
            plastic += magnitude.back() >= yield_stress + hardening * s.fields.at(internal)[c] ? 1.0 : 0.0;
            CHECK(s.fields.at("deviatoric_magnitude")[c] == doctest::Approx(magnitude.back()).epsilon(1e-13));
            CHECK(s.fields.at("von_mises_stress")[c] == doctest::Approx(std::sqrt(3.0) * magnitude.back()).epsilon(1e-13));
            CHECK(s.fields.at("stress_yy")[c] == doctest::Approx(yy.back()).scale(1e9).epsilon(1e-14));
        }
        const auto near = [](double expected) { return doctest::Approx(expected).epsilon(1e-11).scale(1.0); };
        CHECK(column("wall_shear_traction_Pa") == near(mean(s.fields.at("tau"))));
        CHECK(column("wall_normal_traction_Pa") == near(mean(yy)));
        CHECK(column("elastic_energy_J") == near(energy));
        CHECK(column("mean_deviatoric_magnitude_Pa") == near(mean(magnitude)));
        CHECK(column("largest_deviatoric_magnitude_Pa") == near(*std::ranges::max_element(magnitude)));
        CHECK(column("plastic_fraction") == doctest::Approx(plastic / static_cast<double>(magnitude.size())).epsilon(1e-14));
        const std::vector<double>& chi = s.fields.at(internal);
        CHECK(column("smallest_" + internal + suffix) == near(*std::ranges::min_element(chi)));
        CHECK(column("largest_" + internal + suffix) == near(*std::ranges::max_element(chi)));
        if (s.step > 0) // above round-off it is what the fully integrated operator leaves
            CHECK(column("equilibrium_residual") ==
                  doctest::Approx(residual_of(s, width / cells_x, height / cells_y)).epsilon(1e-6).scale(1e-8));
        // the walls' rows of the velocity
        const double u = s.time < load.jump ? load.u : load.after_u, v = s.time < load.jump ? load.v : load.after_v;
        CHECK(column("wall_strain_rate_1/s") == doctest::Approx(u / (0.5 * height)).epsilon(1e-12));
        for (const auto& [field, wall] : {std::pair{"velocity_x", u}, std::pair{"velocity_y", v}}) {
            REQUIRE(s.fields.at(field).size() == (cells_x + 1) * (cells_y + 1)); // the first column comes again as the last
            for (int i = 0; i <= cells_x; ++i) {
                CHECK(s.fields.at(field)[static_cast<std::size_t>(i)] == doctest::Approx(-wall).epsilon(1e-12));
                CHECK(s.fields.at(field)[static_cast<std::size_t>((cells_x + 1) * cells_y + i)] ==
                      doctest::Approx(wall).epsilon(1e-12));
            }
        }
        for (const char* field : {"pressure", "s", "tau", "q", "deviatoric_magnitude"})
            CHECK(s.units.at(field) == "Pa");
        CHECK(s.units.at("velocity_x") == "m/s");
        CHECK(s.units.at(internal) == (suffix.empty() ? "1" : suffix.substr(1)));
    }
}

} // namespace

TEST_SUITE_BEGIN("shear_band_files");

TEST_CASE("every column and every field is what the stress components say, for both laws") {
    const scratch::Folder folder;
    // shear, then shear with the walls closing in, which strains in volume: p and q are as large as tau
    const Loading load{5e-4, 0.0, 0.5, 3e-4, -5e-4};
    // steps end at knots, and hence at the snapshots
    const Arguments arguments{"--wall-history", "0:5e-4:0,0.45:5e-4:0,0.5:5e-4:0,0.5:3e-4:-5e-4,0.95:3e-4:-5e-4",
                              "--duration",     "1",
                              "--snapshots",    "0,0.45,0.95"};
    const Arguments steps{"--scheme", "bogacki-shampine", "--tolerance", "1e-3"};
    run_well(folder / "stz", arguments + steps);
    check_files(folder / "stz", load, "effective_temperature", "_K");
    const auto last = snapshots_in(folder / "stz").back().fields;
    CHECK(std::abs(mean(last.at("q"))) > 0.1 * std::abs(mean(last.at("tau")))); // or the weight of q would not show
    run_well(folder / "perzyna", arguments + steps + Arguments{"--plasticity", "perzyna", "--perzyna-hardening", "1e9"});
    check_files(folder / "perzyna", load, "plastic_strain", "", 1e9);
    run_well(folder / "full", arguments + Arguments{"--scheme", "incremental", "--operator", "full"});
    check_files(folder / "full", load, "effective_temperature", "_K");
    CHECK(history_in(folder / "full").at("equilibrium_residual").back() > 1e-6);
}

TEST_CASE("elastic loading is the closed form: stress, traction, magnitude") {
    const scratch::Folder folder;
    const double u = 4e-4, v = 1e-4, t = 0.4, K = 122e9, mu = 37.4e9; // below yield
    run_well(folder / "run", {"--model", "reduced", "--wall-history", "0:4e-4:1e-4", "--duration", "0.4", "--snapshots", "0.4",
                              "--scheme", "bogacki-shampine"});
    const auto all = snapshots_in(folder / "run");
    REQUIRE(all.size() == 1);
    const double shear = u * t / (0.5 * height), opening = v * t / (0.5 * height);
    const std::map<std::string, double> expected{
        {"pressure", -K * opening},
        {"s", -mu * opening},
        {"tau", mu * shear},
        {"q", -mu / 3.0 * opening},
        {"deviatoric_magnitude", mu * std::sqrt(4.0 / 3.0 * opening * opening + shear * shear)}};
    for (const auto& [name, value] : expected)
        for (const double cell : all[0].fields.at(name))
            CHECK(cell == doctest::Approx(value).epsilon(1e-9));
    const auto history = history_in(folder / "run");
    CHECK(history.at("wall_normal_traction_Pa").back() == doctest::Approx((K + 4.0 / 3.0 * mu) * opening).epsilon(1e-9));
    for (int j = 0; j <= cells_y; ++j)
        for (int i = 0; i <= cells_x; ++i) {
            const auto corner = static_cast<std::size_t>(j * (cells_x + 1) + i);
            const double y = 2.0 * j / cells_y - 1.0;
            CHECK(all[0].fields.at("velocity_x")[corner] == doctest::Approx(u * y).epsilon(1e-9).scale(1e-4));
            CHECK(all[0].fields.at("velocity_y")[corner] == doctest::Approx(v * y).epsilon(1e-9).scale(1e-4));
        }
}

TEST_CASE("even shear: what is not elastic of the strain has accumulated as plastic, at snapshots within steps, too") {
    const scratch::Folder folder;
    for (const auto& scheme : {std::pair{"auto", 2e-5}, {"incremental", 2e-6}, {"cvode-adams", 1e-5}, {"ida", 1e-5}}) {
        CAPTURE(scheme.first);
        run_well(folder / "run", {"--model", "reduced", "--initial", "uniform", "--scheme", scheme.first, "--duration", "1",
                                  "--snapshots", "0,0.3,0.66,0.87,1"});
        const auto all = snapshots_in(folder / "run");
        REQUIRE(all.size() == 5);
        for (const Snapshot& s : all) {
            CAPTURE(s.time);
            const double strain = 2e-7 / 4.05e-6 * s.time; // the walls of +-L at +-2e-7 L/t_s
            const double plastic = (strain - mean(s.fields.at("tau")) / 37.4e9) / std::sqrt(3.0);
            for (std::size_t c = 0; c < s.fields.at("tau").size(); ++c) {
                const double y = height * ((static_cast<double>(c / cells_x) + 0.5) / cells_y - 0.5);
                CHECK(std::abs(s.fields.at("accumulated_plastic_strain")[c] - plastic) < scheme.second);
                CHECK(s.fields.at("displacement_x")[c] == doctest::Approx(strain * y).scale(1e-4).epsilon(1e-9));
                CHECK(std::abs(s.fields.at("displacement_y")[c]) < 1e-15);
            }
        }
        CHECK(all.back().fields.at("accumulated_plastic_strain")[7] > 0.009);
    }
}

TEST_CASE("the internal variable starts where its law says: plastic strain at 0, an effective temperature from 640 K") {
    const scratch::Folder folder;
    run_well(folder / "perzyna", {"--plasticity", "perzyna", "--duration", "0.1", "--snapshots", "0,0.1"});
    const auto perzyna = snapshots_in(folder / "perzyna");
    for (const double strain : perzyna.front().fields.at("plastic_strain"))
        CHECK(strain == 0.0);
    CHECK(history_in(folder / "perzyna").at("largest_plastic_strain").back() == 0.0); // elastic so far
    run_well(folder / "stz", {"--initial", "uniform", "--duration", "0.1", "--snapshots", "0"});
    const auto stz = snapshots_in(folder / "stz");
    for (const double chi : stz.front().fields.at("effective_temperature"))
        CHECK(chi == doctest::Approx(640.0).epsilon(1e-14));

    const auto refused = [&](const Arguments& arguments, const std::string& message) {
        const scratch::Outcome outcome =
            scratch::run("shear_band", Arguments{"--cells", "8", "--output", (folder / "refused").string()} + arguments);
        CAPTURE(outcome.errors);
        CHECK(outcome.status == 2);
        CHECK(contains(outcome.errors, message));
        CHECK_FALSE(fs::exists(folder / "refused"));
    };
    refused({"--plasticity", "perzyna", "--initial-base", "640"},
            "the initial plastic strain is 640 at cell (0, 0): it must be from 0 to 10");
    refused({"--plasticity", "perzyna", "--initial", "uniform", "--initial-base", "-0.01"},
            "the initial plastic strain is -0.01");
    refused({"--initial", "uniform", "--initial-base", "30000"}, "the initial effective temperature is 30000 at cell (0, 0)");
    refused({"--initial-base", "nan"}, "--initial-base nan: it must be a finite number");
}

TEST_CASE("times asked for are the times in the files, to the last bit, whatever the unit of time makes of them") {
    const scratch::Folder folder;
    std::string list;
    std::vector<double> times;
    for (int k = 1; k <= 60; ++k) { // a fifth of them comes back changed from a division by t_s and a product with it
        times.push_back(0.0123 * k + 1e-3 / k);
        list += fmt::format("{}{}", k == 1 ? "" : ",", times.back());
    }
    CHECK(std::ranges::any_of(times, [](double t) { return t / 4.05e-6 * 4.05e-6 != t; }));
    run_well(folder / "run", {"--duration", fmt::format("{}", times.back()), "--snapshots", list, "--tolerance", "1e-3"});
    const auto all = snapshots_in(folder / "run");
    REQUIRE(all.size() == times.size());
    for (std::size_t k = 0; k < times.size(); ++k)
        CHECK(all[k].time == times[k]);
}

TEST_CASE("snapshots change no step, and show what a run that ends there would") {
    const scratch::Folder folder;
    for (const std::string scheme : {"auto", "dormand-prince", "chebyshev"}) {
        CAPTURE(scheme);
        const Arguments steps{"--scheme", scheme, "--initial", "uniform", "--wall-history", "0:5e-4,0.61:5e-4,0.61:2e-4"};
        run_well(folder / "without", steps + Arguments{"--duration", "0.8", "--snapshots", "0.8"});
        run_well(folder / "with", steps + Arguments{"--duration", "0.8", "--snapshots", "0", "--snapshots-every", "0.01"});
        CHECK(scratch::read(folder / "with" / "history.csv") == scratch::read(folder / "without" / "history.csv"));
        const auto all = snapshots_in(folder / "with");
        REQUIRE(all.size() == 81);
        CHECK(all.back().fields == snapshots_in(folder / "without").back().fields);
        CHECK(summary_in(folder / "with")["steps"] < 70);
        for (const std::size_t k : {30, 55, 61, 70}) {
            CAPTURE(k);
            CHECK(all[k].time == doctest::Approx(0.01 * static_cast<double>(k)).epsilon(1e-14));
            if (k != 61)
                CHECK(all[k].step < summary_in(folder / "with")["steps"]);
            run_well(folder / "there", steps + Arguments{"--duration", fmt::format("{}", all[k].time), "--tolerance", "1e-8"});
            const auto row = history_in(folder / "there");
            CHECK(mean(all[k].fields.at("tau")) == doctest::Approx(row.at("wall_shear_traction_Pa").back()).epsilon(2e-4));
            CHECK(mean(all[k].fields.at("effective_temperature")) ==
                  doctest::Approx(row.at("largest_effective_temperature_K").back()).epsilon(2e-5));
            CHECK(residual_of(all[k], width / cells_x, height / cells_y) < 1e-12);
        }
    }
}

TEST_CASE("numbers that no solid has, and loads that inertia would bear, are warnings; what has no meaning is refused") {
    const scratch::Folder folder;
    int number = 0;
    const auto warnings_in = [](const fs::path& output) {
        auto warnings = summary_in(output)["warnings"].get<std::vector<std::string>>();
        // so few cells do not show the pattern of the start
        std::erase_if(warnings, [](const std::string& warning) { return contains(warning, "the finest scales of the space"); });
        return warnings;
    };
    const auto said = [&](const Arguments& arguments, const std::string& part) {
        const fs::path output = folder / std::to_string(number++);
        run_well(output, arguments + Arguments{"--duration", "1e-7", "--snapshots", "0"});
        const std::vector<std::string> warnings = warnings_in(output);
        CAPTURE(warnings.size());
        CHECK(std::ranges::any_of(warnings, [&](const std::string& warning) { return contains(warning, part); }));
        return warnings.size();
    };
    CHECK(said({"--yield-stress", "850"}, "a yield stress of 850 Pa") == 2); // and is reached before waves have passed
    CHECK(said({"--yield-stress", "20e9"}, "0.196 times Young's modulus") == 1);
    CHECK(said({"--width", "20"}, "833 times as long one way") == 1);
    CHECK(said({"--wall-velocity", "10"}, "times the 8.1e-06 s that shear waves take") == 1);
    CHECK(said({"--stz-bath-temperature", "650"}, "below the bath's 650 K") == 1);
    CHECK(said({"--stz-bath-temperature", "950", "--initial-base", "960"}, "this is a melt") == 1);
    const fs::path late = folder / "late";
    run_well(late, {"--duration", "1e-7", "--snapshots", "0,1.0000000000001e-7,2e-7"});
    CHECK(warnings_in(late).at(0) ==
          "the snapshot at 2e-07 s lies beyond the end at 1e-07 s and will be missing: lengthen --duration");
    CHECK(io::Hdf5File::open(late / "fields.h5").members("snapshots").size() == 2);
    run_well(folder / "plain", {"--duration", "1e-7"});
    CHECK(warnings_in(folder / "plain").empty());

    const auto refused = [&](const Arguments& arguments, int status, const std::string& message) {
        const scratch::Outcome outcome = scratch::run(
            "shear_band",
            Arguments{"--cells", "8", "--threads", "1", "--quiet", "--output", (folder / "refused").string()} + arguments);
        CAPTURE(outcome.errors);
        CHECK(outcome.status == status);
        CHECK(contains(outcome.errors, message));
    };
    for (const char* speed : {"1e5", "1e30", "1e300", "-1e300"})
        refused({"--wall-velocity", speed}, 2, "equilibrium has no meaning there");
    refused({"--width", "1e-300"}, 2, "times as long one way as the other");
    refused({"--yield-stress", "1e-300"}, 2, "overflow");
    refused({"--step", "fixed", "--dt", "1e-300"}, 2, "--dt 1e-300: the run to 1.4175 s would take");
}

TEST_SUITE_END();

} // namespace shear_band_files_suite
