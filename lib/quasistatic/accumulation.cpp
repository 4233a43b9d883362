// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/quasistatic/accumulation.hpp>

#include <array>
#include <utility>

namespace ductile::quasistatic {

namespace {
using Term = Space::Term;
}

Accumulation::Accumulation(const Scene& scene, Space& space, const State& start, bool velocity_of_middle)
    : scene_(scene), space_(space), velocity_of_middle_(velocity_of_middle), now_(scene.grid, 1), rates_(now_), next_rates_(now_),
      velocity_(space.make_velocity()), room_(space.make_cells()) {
    if (scene.model == Model::full) {
        predicted_ = carried_ = now_;
        middle_ = force_ = space.make_velocity();
    }
    space.add_affine(start.cells.wall, velocity_);
    space.at_points(velocity_, now_.stress.q, now_.internal[0]);
    now_.wrap();
}

void Accumulation::begin(const State& state) {
    from_ = &now_;
    time_ = state.time;
    velocity_ = state.velocity;
    if (!knows_rates_)
        space_.plastic_strain_rate(state.cells, room_, rates_.stress.p);
    space_.at_points(velocity_, rates_.stress.q, rates_.internal[0]);
    knows_rates_ = true;
}

void Accumulation::lead(const CellState& from, const State& to, CellState& y) {
    const double dt = to.time - time_;
    space_.plastic_strain_rate(to.cells, room_, next_rates_.stress.p);
    space_.at_points(to.velocity, next_rates_.stress.q, next_rates_.internal[0]);
    if (velocity_of_middle_)
        space_.at_points(to.velocity, rates_.stress.q, rates_.internal[0]);
    if (scene_.model == Model::reduced) {
        space_.combine(std::array{Term{&from, 1.0}, Term{&rates_, 0.5 * dt}, Term{&next_rates_, 0.5 * dt}}, y);
        return;
    }
    space_.combine(
        std::array{Term{&from, 1.0}, Term{&rates_, 0.25 * dt}, Term{&next_rates_, 0.25 * dt}, Term{&carried_, 0.5 * dt}},
        predicted_);
    if (!velocity_of_middle_)
        extrapolate(velocity_, to.velocity, -0.5, middle_);
    space_.transport(predicted_, velocity_of_middle_ ? to.velocity : middle_, carried_, force_);
    space_.combine(std::array{Term{&from, 1.0}, Term{&rates_, 0.5 * dt}, Term{&next_rates_, 0.5 * dt}, Term{&carried_, dt}}, y);
}

void Accumulation::turn(const State& at) {
    std::swap(rates_, next_rates_);
    time_ = at.time;
    velocity_ = at.velocity;
}

void Accumulation::pass(const State& state) {
    if (from_ == &now_)
        within_ = now_;
    knows_rates_ = false;
    lead(within_, state, within_);
    from_ = &within_;
    turn(state);
}

Accumulated Accumulation::at(const State& state) {
    shown_ = *from_; // its shape
    const CellState carried = carried_;
    lead(*from_, state, shown_);
    carried_ = carried;
    return view_of(shown_);
}

void Accumulation::end(const State& state) {
    lead(*from_, state, now_);
    turn(state);
    knows_rates_ = true;
}

std::vector<std::pair<std::string, Field*>> Accumulation::named_fields() {
    std::vector<std::pair<std::string, Field*>> fields{{"accumulated_plastic_strain", &now_.stress.p},
                                                       {"displacement_x", &now_.stress.q},
                                                       {"displacement_y", &now_.internal[0]}};
    if (scene_.model == Model::full) {
        fields.emplace_back("carried_plastic_strain", &carried_.stress.p);
        fields.emplace_back("carried_displacement_x", &carried_.stress.q);
        fields.emplace_back("carried_displacement_y", &carried_.internal[0]);
    }
    return fields;
}

} // namespace ductile::quasistatic
