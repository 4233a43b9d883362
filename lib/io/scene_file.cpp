// SPDX-License-Identifier: GPL-3.0-or-later
#include <ductile/base/error.hpp>
#include <ductile/io/checkpoint.hpp>
#include <ductile/io/config_file.hpp>
#include <ductile/io/keys.hpp>
#include <ductile/io/nearest_name.hpp>
#include <ductile/io/scene_file.hpp>

#include <fmt/format.h>

#include <algorithm>
#include <string_view>

namespace ductile::io {
namespace {

void read_carrier(SceneCall& call, const std::string& text, const std::string& source) {
    const std::vector<std::string> carriers = {"grid", "points"};
    const ConfigNode scene = read_config(text, source);
    const ConfigNode* carrier = scene.find("carrier");
    if (carrier == nullptr)
        throw InputError(
            fmt::format("{}: the key 'carrier' is missing: a scene begins with carrier = \"grid\" (quasi-static, on a grid "
                        "that stays) or carrier = \"points\" (material points)",
                        source));
    if (std::ranges::find(carriers, carrier->text) == carriers.end())
        throw InputError(fmt::format("{}, line {}: carrier = {}: it must be one of grid, points{}", source, carrier->line,
                                     to_toml(*carrier), did_you_mean(carrier->text, carriers)));
    call.carrier = carrier->text;
    call.has_tables = std::ranges::any_of(scene.children, &ConfigNode::is_table);
}

} // namespace

SceneCall scene_call(int argc, const char* const* argv) {
    SceneCall call;
    const std::vector<std::string_view> words(argv + 1, argv + argc);
    const bool has_file = !words.empty() && !words.front().starts_with('-');
    call.arguments.assign(argv, argv + argc);
    if (has_file) {
        call.file = words.front();
        try {
            check_storable(call.file.string()); // the default of --output is made of it
        } catch (const InputError& error) {
            throw InputError(fmt::format("{}: the name of the file: {}", visible(call.file.string()), error.what()));
        }
        call.arguments.erase(call.arguments.begin() + 1);
        read_carrier(call, read_config_file(call.file.string()), call.file.string());
        return call;
    }
    for (std::size_t k = 0; k < words.size(); ++k) {
        constexpr std::string_view option = "--restart";
        const bool joined = words[k].starts_with("--restart=");
        if (joined || (words[k] == option && k + 1 < words.size())) {
            const std::string path(joined ? words[k].substr(option.size() + 1) : words[k + 1]);
            read_carrier(call, CheckpointReader(path, "scene").config(), path);
            return call;
        }
    }
    if (std::ranges::none_of(words,
                             [](std::string_view word) { return word == "--help" || word == "-h" || word == "--version"; }))
        throw InputError(
            "which scene? ./ductile scene FILE.toml [--key value ...]; drivers/scenes has some, and --print-config of "
            "every program prints one");
    call.carrier = "points";
    call.has_tables = true;
    return call;
}

} // namespace ductile::io
