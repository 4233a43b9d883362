// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/quasistatic/accumulation.hpp>

#include <utility>

namespace ductile::quasistatic {

Accumulation::Accumulation(const Scene& scene, Space& space, const State& start, bool velocity_of_middle)
    : scene_(scene), space_(space), velocity_of_middle_(velocity_of_middle), velocity_(space.make_velocity()),
      middle_(velocity_) {
    const Field zero(scene.grid.cells_y, scene.grid.cells_x, 2); // ghost rows for advect()
    now_.fill(zero);
    rate_ = next_rate_ = velocity_x_ = velocity_y_ = zero;
    if (scene.model == Model::full)
        predicted_ = carried_ = now_;
    space.add_affine(start.cells.wall, velocity_);
    space.at_points(velocity_, now_[1], now_[2]);
    for (Field& field : now_)
        field.wrap();
}

void Accumulation::begin(const State& state) {
    from_ = &now_;
    time_ = state.time;
    velocity_ = state.velocity;
    if (!knows_rate_)
        space_.plastic_strain_rate(state.cells, rate_);
    knows_rate_ = true;
}

void Accumulation::lead(const Fields& from, const State& to, Fields& y) {
    const double dt = to.time - time_;
    space_.plastic_strain_rate(to.cells, next_rate_);
    if (!velocity_of_middle_)
        extrapolate(velocity_, to.velocity, -0.5, middle_);
    const VectorField& velocity = velocity_of_middle_ ? to.velocity : middle_;
    space_.at_points(velocity, velocity_x_, velocity_y_);
    // dt times the sum of rates, and of what is carried along, if it is
    const auto advance = [&](double by, const Fields* carried, Fields& target) {
        const double by_carried = carried ? by : 0.0;
        const Fields& there = carried ? *carried : from;
        combine({{&from[0], 1.0}, {&rate_, 0.5 * by}, {&next_rate_, 0.5 * by}, {&there[0], by_carried}}, target[0]);
        combine({{&from[1], 1.0}, {&velocity_x_, by}, {&there[1], by_carried}}, target[1]);
        combine({{&from[2], 1.0}, {&velocity_y_, by}, {&there[2], by_carried}}, target[2]);
    };
    if (scene_.model == Model::reduced) {
        advance(dt, nullptr, y);
        return;
    }
    advance(0.5 * dt, &carried_, predicted_);
    space_.advect(predicted_, velocity, carried_);
    advance(dt, &carried_, y);
}

void Accumulation::turn(const State& at) {
    std::swap(rate_, next_rate_);
    time_ = at.time;
    velocity_ = at.velocity;
}

void Accumulation::pass(const State& state) {
    if (from_ == &now_)
        within_ = now_;
    knows_rate_ = false;
    lead(within_, state, within_);
    from_ = &within_;
    turn(state);
}

Accumulated Accumulation::at(const State& state) {
    shown_ = *from_; // its shape
    const Fields carried = carried_;
    lead(*from_, state, shown_);
    carried_ = carried;
    return view_of(shown_);
}

void Accumulation::end(const State& state) {
    lead(*from_, state, now_);
    turn(state);
    knows_rate_ = true;
}

std::vector<std::pair<std::string, Field*>> Accumulation::named_fields() {
    std::vector<std::pair<std::string, Field*>> fields{
        {"accumulated_plastic_strain", &now_[0]}, {"displacement_x", &now_[1]}, {"displacement_y", &now_[2]}};
    if (scene_.model == Model::full) {
        fields.emplace_back("carried_plastic_strain", &carried_[0]);
        fields.emplace_back("carried_displacement_x", &carried_[1]);
        fields.emplace_back("carried_displacement_y", &carried_[2]);
    }
    return fields;
}

} // namespace ductile::quasistatic
