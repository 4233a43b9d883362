// SPDX-License-Identifier: GPL-3.0-or-later
// A checkpoint with any changes, its checksum right again: `scene --restart` either goes on from it and comes through one step,
// or refuses it with an InputError or RunError that has a message.
//
// Bytes of a file at random would end at the checksum, and behind it in the HDF5 library, whose robustness is not the matter
// here. So the input is a list of edits: it picks one of three real checkpoints (grid, points with a rigid body, a grid scene on
// points), and in it attributes, datasets and places of the configuration text, and says what becomes of them: removed, renamed,
// another number, type, shape or text. The edited file is sealed again. history.csv and fields.h5 beside it get changed bytes.
#include "calls.hpp"

#include <ductile/io/checksum.hpp>

#include <fuzzer/FuzzedDataProvider.h>
#include <hdf5.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <limits>
#include <utility>

using namespace ductile::fuzz;
namespace fs = std::filesystem;

namespace {

std::string read(const fs::path& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
}

constexpr std::string_view scenes[] = {R"(carrier = "grid"
cells = "6x5"
duration = 0.5
snapshots = [0]
)",
                                       R"(carrier = "points"
cell-size = 1e-3
dt = 1e-4
duration = 1e-3
snapshots = [0]
[grid]
geometry = "axisymmetric"
width = 0.006
height = 0.007
[sides]
left = "slip"
bottom = "slip"
[materials.steel]
law = "von-mises"
young-modulus = 200e9
poisson-ratio = 0.3
density = 7800
yield-stress = 0.7e9
[[bodies]]
material = "steel"
shape = {rectangle = [0, 0, 3e-3, 4e-3]}
[[rigid-bodies]]
name = "platen"
shape = {rectangle = [0, 4e-3, 5e-3, 5e-3]}
velocity = [0, -1]
[[observables]]
name = "load_N"
quantity = "force-y"
)",
                                       R"(carrier = "points"
cells = "6x6"
duration = 1e-2
snapshots = [0]
)"};

/// A run's files as they were, and the names of what is in its checkpoint.
struct Base {
    std::string checkpoint, history, fields; ///< bytes, the first without its seal
    std::vector<std::string> datasets;
    std::vector<std::pair<std::string, std::string>> attributes; ///< object, name
};

Base make_base(std::string_view scene, const Folder& folder) {
    write(folder / "scene.toml", scene);
    const fs::path run = folder / "base";
    interrupt_after(3);
    call(program_named("scene"), {"scene", folder / "scene.toml"}, run, Keep::files);
    Base base{.checkpoint = read(run / "checkpoint.h5"), .history = read(run / "history.csv"), .fields = read(run / "fields.h5")};
    const hid_t file = H5Fopen((run / "checkpoint.h5").c_str(), H5F_ACC_RDONLY, H5P_DEFAULT);
    if (file < 0)
        std::abort();
    const auto note = [](hid_t at, const char* name, const H5O_info_t* info, void* out) -> herr_t {
        Base& found = *static_cast<Base*>(out);
        if (info->type == H5O_TYPE_DATASET)
            found.datasets.emplace_back(name);
        const hid_t object = H5Oopen(at, name, H5P_DEFAULT);
        for (hsize_t k = 0; k < info->num_attrs; ++k) {
            char attribute[100];
            H5Aget_name_by_idx(object, ".", H5_INDEX_NAME, H5_ITER_INC, k, attribute, sizeof attribute, H5P_DEFAULT);
            found.attributes.emplace_back(name, attribute);
        }
        H5Oclose(object);
        return 0;
    };
    H5Ovisit(file, H5_INDEX_NAME, H5_ITER_INC, note, &base);
    H5Fclose(file);
    base.checkpoint.resize(base.checkpoint.rfind("\nductile: "));
    fs::remove_all(run);
    return base;
}

double any_number(FuzzedDataProvider& input) {
    constexpr double infinity = std::numeric_limits<double>::infinity();
    constexpr std::array chosen{0.0, -0.0, 1.0, -1.0,  1e-300,   1e300,     -1e300,
                                1e9, 1e18, 0.5, -1e-6, infinity, -infinity, std::numeric_limits<double>::quiet_NaN()};
    return input.ConsumeBool() ? input.PickValueInArray(chosen) : input.ConsumeFloatingPoint<double>();
}

std::int64_t any_integer(FuzzedDataProvider& input) {
    constexpr std::array<std::int64_t, 10> chosen{
        0, 1, -1, 2, 1'000'000'007, std::int64_t{1} << 31, std::int64_t{1} << 62, INT64_MIN, INT64_MAX, 7};
    return input.ConsumeBool() ? input.PickValueInArray(chosen) : input.ConsumeIntegral<std::int64_t>();
}

hid_t text_type() {
    const hid_t type = H5Tcopy(H5T_C_S1);
    H5Tset_size(type, H5T_VARIABLE);
    H5Tset_cset(type, H5T_CSET_UTF8);
    return type;
}

void edit_attribute(hid_t file, const Base& base, FuzzedDataProvider& input) {
    const auto& edited = base.attributes[input.ConsumeIntegralInRange<std::size_t>(0, base.attributes.size() - 1)];
    const std::string &object = edited.first, &name = edited.second;
    H5Adelete_by_name(file, object.c_str(), name.c_str(), H5P_DEFAULT);
    const auto put = [&](hid_t type, const void* value, hsize_t count = 1) {
        const hid_t space = count == 1 ? H5Screate(H5S_SCALAR) : H5Screate_simple(1, &count, nullptr);
        const hid_t made =
            H5Acreate_by_name(file, object.c_str(), name.c_str(), type, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
        H5Awrite(made, type, value);
        H5Aclose(made);
        H5Sclose(space);
    };
    switch (input.ConsumeIntegralInRange(0, 4)) {
    case 0:
        break; // it is gone
    case 1: {
        const double value = any_number(input);
        put(H5T_NATIVE_DOUBLE, &value);
        break;
    }
    case 2: {
        const std::int64_t value = any_integer(input);
        put(H5T_NATIVE_INT64, &value);
        break;
    }
    case 3: {
        const std::string text = input.ConsumeRandomLengthString(60);
        const char* first = text.c_str();
        const hid_t type = text_type();
        put(type, &first);
        H5Tclose(type);
        break;
    }
    case 4: {
        const std::array values{any_number(input), any_number(input), any_number(input)};
        put(H5T_NATIVE_DOUBLE, values.data(), values.size());
        break;
    }
    }
}

void edit_dataset(hid_t file, const Base& base, FuzzedDataProvider& input) {
    const std::string& name = base.datasets[input.ConsumeIntegralInRange<std::size_t>(0, base.datasets.size() - 1)];
    const int edit = input.ConsumeIntegralInRange(0, 4);
    if (edit == 0) {
        H5Ldelete(file, name.c_str(), H5P_DEFAULT);
        return;
    }
    if (edit == 1) {
        const std::string& other = base.datasets[input.ConsumeIntegralInRange<std::size_t>(0, base.datasets.size() - 1)];
        H5Ldelete(file, other.c_str(), H5P_DEFAULT);
        H5Lmove(file, name.c_str(), H5L_SAME_LOC, other.c_str(), H5P_DEFAULT, H5P_DEFAULT);
        return;
    }
    const hid_t data = H5Dopen2(file, name.c_str(), H5P_DEFAULT);
    if (data < 0)
        return; // an earlier edit removed it
    const hid_t type = H5Dget_type(data), space = H5Dget_space(data);
    const H5T_class_t kind = H5Tget_class(type);
    const auto count = static_cast<std::size_t>(H5Sget_simple_extent_npoints(space));
    if (kind == H5T_STRING && count == 1) { // the configuration
        char* text = nullptr;
        H5Dread(data, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, &text);
        std::string config = text == nullptr ? "" : text;
        H5free_memory(text);
        const std::size_t at = input.ConsumeIntegralInRange<std::size_t>(0, config.size());
        const std::size_t length = std::min<std::size_t>(config.size() - at, input.ConsumeIntegralInRange(0, 30));
        config.replace(at, length, input.ConsumeRandomLengthString(60));
        const char* first = config.c_str();
        H5Dwrite(data, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, &first);
    } else if (edit == 2 && kind != H5T_STRING && count > 0 && count <= 10'000) { // some values
        const bool whole = kind == H5T_INTEGER;
        std::vector<double> values(count);
        std::vector<std::int64_t> integers(count);
        const hid_t memory = whole ? H5T_NATIVE_INT64 : H5T_NATIVE_DOUBLE;
        void* const place = whole ? static_cast<void*>(integers.data()) : values.data();
        H5Dread(data, memory, H5S_ALL, H5S_ALL, H5P_DEFAULT, place);
        const std::size_t at = input.ConsumeIntegralInRange<std::size_t>(0, count - 1);
        const std::size_t end = input.ConsumeBool() ? count : at + 1;
        const double number = any_number(input);
        const std::int64_t integer = any_integer(input);
        for (std::size_t k = at; k < end; ++k) {
            values[k] = number;
            integers[k] = integer;
        }
        H5Dwrite(data, memory, H5S_ALL, H5S_ALL, H5P_DEFAULT, place);
    } else { // another shape or type; zeros, of which nothing is stored
        constexpr std::array<hsize_t, 10> extents{0, 1, 2, 3, 5, 6, 7, 36, hsize_t{1} << 31, hsize_t{1} << 40};
        std::vector<hsize_t> shape;
        for (int rank = input.ConsumeIntegralInRange(0, 3); rank > 0; --rank)
            shape.push_back(input.PickValueInArray(extents));
        const hid_t other =
            shape.empty() ? H5Screate(H5S_SCALAR) : H5Screate_simple(static_cast<int>(shape.size()), shape.data(), nullptr);
        const hid_t text = text_type();
        const std::array types{H5T_NATIVE_DOUBLE, H5T_NATIVE_FLOAT, H5T_NATIVE_INT64, H5T_NATIVE_INT8, text};
        const hid_t create = H5Pcreate(H5P_DATASET_CREATE);
        const std::vector<hsize_t> chunk(shape.size(), 1);
        if (!shape.empty())
            H5Pset_chunk(create, static_cast<int>(chunk.size()), chunk.data());
        H5Ldelete(file, name.c_str(), H5P_DEFAULT);
        const hid_t made = H5Dcreate2(file, name.c_str(), types[input.ConsumeIntegralInRange<std::size_t>(0, types.size() - 1)],
                                      other, H5P_DEFAULT, create, H5P_DEFAULT);
        if (made >= 0)
            H5Dclose(made);
        H5Pclose(create);
        H5Tclose(text);
        H5Sclose(other);
    }
    H5Sclose(space);
    H5Tclose(type);
    H5Dclose(data);
}

void edit_bytes(std::string& bytes, FuzzedDataProvider& input) {
    if (bytes.empty())
        return;
    const std::size_t at = input.ConsumeIntegralInRange<std::size_t>(0, bytes.size() - 1);
    const std::size_t length = std::min<std::size_t>(bytes.size() - at, input.ConsumeIntegralInRange(0, 1000));
    bytes.replace(at, length, input.ConsumeRandomLengthString(30));
}

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    static const Folder folder;
    static const std::array<Base, 3> bases{make_base(scenes[0], folder), make_base(scenes[1], folder),
                                           make_base(scenes[2], folder)};

    FuzzedDataProvider input(data, size);
    const Base& base = bases[input.ConsumeIntegralInRange<std::size_t>(0, bases.size() - 1)];
    const bool in_its_folder = input.ConsumeBool();
    std::string history = base.history, fields = base.fields;
    const fs::path run = folder / "run", checkpoint = run / "checkpoint.h5";
    fs::create_directory(run);
    write(checkpoint, base.checkpoint);
    const hid_t file = H5Fopen(checkpoint.c_str(), H5F_ACC_RDWR, H5P_DEFAULT);
    for (int edits = input.ConsumeIntegralInRange(0, 4); edits > 0; --edits)
        switch (input.ConsumeIntegralInRange(0, 5)) {
        case 0:
        case 1:
            edit_attribute(file, base, input);
            break;
        case 2:
        case 3:
            edit_dataset(file, base, input);
            break;
        case 4:
            edit_bytes(history, input);
            break;
        case 5:
            edit_bytes(fields, input);
            break;
        }
    H5Fclose(file);
    ductile::io::seal(checkpoint);
    write(run / "history.csv", history);
    write(run / "fields.h5", fields);
    std::vector<std::string> words{"scene", "--restart", checkpoint};
    while (input.remaining_bytes() > 0 && words.size() < 6)
        words.push_back(input.ConsumeRandomLengthString(30).c_str());
    interrupt_after(1);
    call(program_named("scene"), std::move(words), in_its_folder ? run : folder / "out");
    fs::remove_all(run);
    return 0;
}
