// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/io/snapshot_meshes.hpp>

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <span>
#include <string_view>

namespace ductile::io {

namespace {

constexpr std::array<std::string_view, 3> vector_parts{"_x", "_y", ""};
constexpr std::array<std::string_view, 9> tensor_parts{"_xx", "_xy", "", "_xy", "_yy", "", "", "", "_zz"};

} // namespace

std::vector<CompositeField> composites_of(const StoredSnapshot& snapshot) {
    std::vector<CompositeField> fields;
    const auto find = [&](const std::string& name) {
        const auto found = std::ranges::find(snapshot.datasets, name, &SnapshotDataset::name);
        return found == snapshot.datasets.end() ? nullptr : &*found;
    };
    const auto add = [&](const SnapshotDataset& first, std::span<const std::string_view> endings) {
        if (is_point_set(first) || !first.name.ends_with(endings.front()))
            return;
        CompositeField field{.name = first.name.substr(0, first.name.size() - endings.front().size()), .like = &first};
        for (const std::string_view ending : endings) {
            field.parts.push_back(ending.empty() ? std::string() : fmt::format("{}{}", field.name, ending));
            if (ending.empty())
                continue;
            const SnapshotDataset* const part = find(field.parts.back());
            if (!part || part->shape != first.shape || part->centring != first.centring)
                return;
        }
        fields.push_back(std::move(field));
    };
    for (const SnapshotDataset& dataset : snapshot.datasets) {
        add(dataset, vector_parts);
        add(dataset, tensor_parts);
    }
    return fields;
}

std::string view_path(const StoredSnapshot& snapshot, const CompositeField& field) {
    return fmt::format("views/{}/{}", snapshot.group.substr(snapshot.group.rfind('/') + 1), field.name);
}

bool is_point_set(const SnapshotDataset& dataset) { return dataset.centring.empty() && dataset.shape.size() == 2; }

std::string vertices_path(std::size_t points) { return fmt::format("vertices/{}", points); }

std::string no_field_path(std::size_t points, std::size_t components) { return fmt::format("none/{}x{}", points, components); }

} // namespace ductile::io
