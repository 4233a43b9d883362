// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once
#include <ductile/io/keys.hpp>

#include <functional>
#include <string>
#include <utility>
#include <vector>

namespace ductile::io {

/// The tables of a scene file, in one visit that reads them, or writes them down: the visitor declares the keys of each.
class Tables {
public:
    /// For writing.
    Tables() = default;
    /// For reading those of a file; `source` is its name in messages, and what paths in it are relative to.
    Tables(const ConfigNode& root, std::string source) : root_(&root), source_(std::move(source)) {}

    /// [name]; one that the file does not have keeps its values.
    void table(const std::string& name, const std::string& meaning, const std::function<void(Keys&)>& declare);
    /// [[name]]: `declare(keys, value)` for each of the values, which are those of the file, if it has any.
    template <class T, class Declare>
    void list(const std::string& name, const std::string& meaning, std::vector<T>& values, const Declare& declare) {
        each(name, "[[" + name + "]]", meaning, values, declare, nodes(name, false));
    }
    /// [name.X]: the same for values that have a name.
    template <class T, class Declare>
    void named(const std::string& name, const std::string& meaning, std::vector<T>& values, const Declare& declare) {
        each(name, {}, meaning, values, declare, nodes(name, true));
    }
    /// Throws InputError for a table that was not visited.
    void refuse_unknown() const;

    /// As a file, each key with its meaning where it comes first.
    [[nodiscard]] const std::string& text() const { return text_; }
    /// "[grid] width" and the like, and values, for comparisons.
    [[nodiscard]] const std::vector<std::pair<std::string, std::string>>& entries() const { return entries_; }

private:
    template <class T, class Declare>
    void each(const std::string& name, const std::string& head, const std::string& meaning, std::vector<T>& values,
              const Declare& declare, const std::vector<const ConfigNode*>& found) {
        if (root_ != nullptr)
            values.assign(found.size(), T{});
        for (std::size_t k = 0; k < values.size(); ++k) {
            if (root_ != nullptr && head.empty())
                values[k].name = name_of(name, *found[k]);
            const std::string place = head.empty() ? "[" + name + "." + toml_key(values[k].name) + "]" : head;
            one(place, k == 0 ? meaning : "", head.empty() ? 0 : k + 1, root_ ? found[k] : nullptr,
                [&](Keys& keys) { declare(keys, values[k]); });
        }
    }
    /// Reads from the node, or writes.
    void one(const std::string& place, const std::string& meaning, std::size_t number, const ConfigNode* node,
             const std::function<void(Keys&)>& declare);
    [[nodiscard]] std::vector<const ConfigNode*> nodes(const std::string& name, bool named);
    /// The X of [name.X].
    [[nodiscard]] std::string name_of(const std::string& name, const ConfigNode& node) const;

    const ConfigNode* root_ = nullptr; // null: writing
    std::string source_, text_;
    std::vector<std::string> visited_, explained_;
    std::vector<std::pair<std::string, std::string>> entries_;
};

} // namespace ductile::io
