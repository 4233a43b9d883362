// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/base/error.hpp>
#include <ductile/io/nearest_name.hpp>
#include <ductile/io/tables.hpp>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

namespace ductile::io {

void Tables::table(const std::string& name, const std::string& meaning, const std::function<void(Keys&)>& declare) {
    visited_.push_back(name);
    const ConfigNode* node = root_ ? root_->find(name) : nullptr;
    if (root_ == nullptr || node != nullptr)
        one(fmt::format("[{}]", name), meaning, 0, node, declare);
}

std::vector<const ConfigNode*> Tables::nodes(const std::string& name, bool named) {
    visited_.push_back(name);
    const ConfigNode* node = root_ ? root_->find(name) : nullptr;
    std::vector<const ConfigNode*> found;
    if (node == nullptr)
        return found;
    if (named ? !node->is_table() : !node->is_array())
        throw InputError(fmt::format("{}, line {}: '{}' must stand in tables of its own, each headed {}", source_, node->line,
                                     name, named ? fmt::format("[{}.a-name]", name) : fmt::format("[[{}]]", name)));
    for (const ConfigNode& child : node->children)
        found.push_back(&child);
    return found;
}

std::string Tables::name_of(const std::string& name, const ConfigNode& node) const {
    try {
        check_storable(node.key);
    } catch (const InputError& error) {
        throw InputError(
            fmt::format("{}, line {}: [{}.\"{}\"]: the name: {}", source_, node.line, name, visible(node.key), error.what()));
    }
    return node.key;
}

void Tables::one(const std::string& place, const std::string& meaning, std::size_t number, const ConfigNode* node,
                 const std::function<void(Keys&)>& declare) {
    if (root_ != nullptr) {
        Keys keys(*node, source_, place);
        declare(keys);
        keys.refuse_unknown();
        return;
    }
    Keys keys;
    declare(keys);
    text_ += "\n";
    if (!meaning.empty())
        text_ += fmt::format("# {}\n", meaning);
    text_ += fmt::format("{}\n", place);
    for (const Keys::Declared& declared : keys.declared_) {
        if (declared.text().empty())
            continue;
        const std::string value = declared.toml_value(), kind = place.substr(0, place.find('.')) + " " + declared.key;
        if (std::ranges::find(explained_, kind) == explained_.end()) {
            text_ += fmt::format("# {}\n", declared.description());
            explained_.push_back(kind);
        }
        text_ += fmt::format("{}={}\n", declared.key, value);
        entries_.emplace_back(number == 0 ? fmt::format("{} {}", place, declared.key)
                                          : fmt::format("{} {}, {}", place, number, declared.key),
                              value);
    }
}

void Tables::refuse_unknown() const {
    for (const ConfigNode& child : root_->children)
        if (const bool holds_tables = child.is_array() && !child.children.empty() && child.children.front().is_table();
            (child.is_table() || holds_tables) && std::ranges::find(visited_, child.key) == visited_.end())
            throw InputError(fmt::format("{}, line {}: there is no table '{}'{}; a scene has {}", source_, child.line,
                                         visible(child.key), did_you_mean(child.key, visited_),
                                         visited_.empty() ? "none here" : fmt::format("{}", fmt::join(visited_, ", "))));
}

} // namespace ductile::io
