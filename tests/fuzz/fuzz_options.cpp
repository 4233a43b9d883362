// SPDX-License-Identifier: GPL-3.0-or-later
// Any words as a command line: the first names a program, the others are its options. It either takes them and comes to its first
// step, or refuses them with an InputError that has a message, before it writes anything. A file FILE beside them, the text after
// a line "---", is there for --config.
#include "calls.hpp"

#include <algorithm>
#include <cstdint>

using namespace ductile::fuzz;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    static const Folder folder;
    std::string text(reinterpret_cast<const char*>(data), size);
    if (const std::size_t rule = text.find("\n---\n"); rule != text.npos) {
        write(folder / "FILE", std::string_view(text).substr(rule + 5));
        text.resize(rule);
    }
    std::ranges::replace(text, '\0', ' '); // no word of a command line has one
    std::vector<std::string> words;
    for (std::size_t begin = 0; (begin = text.find_first_not_of(" \n", begin)) != text.npos;) {
        const std::size_t end = std::min(text.find_first_of(" \n", begin), text.size());
        std::string word = text.substr(begin, end - begin);
        if (const std::size_t name = word.find("FILE"); name != word.npos && !words.empty())
            word.replace(name, 4, folder / "FILE");
        words.push_back(std::move(word));
        begin = end;
    }
    const Program program = words.empty() ? nullptr : program_named(words.front());
    if (program == nullptr)
        return -1;
    if (words.front() == "shear_band")
        words.insert(words.begin() + 1, {"--cells", "8"}); // unless others follow: the default's set-up takes its time
    call(program, words, folder / "out");
    return 0;
}
