// SPDX-License-Identifier: GPL-3.0-or-later
#include "io_scratch.hpp"
#include "messages.hpp"

#include <ductile/io/atomic_file.hpp>
#include <ductile/io/checkpoint.hpp>
#include <ductile/io/checksum.hpp>
#include <ductile/io/hdf5.hpp>
#include <ductile/io/output_folder.hpp>

#include <doctest/doctest.h>
#include <hdf5.h>

#include <bit>
#include <cstdint>
#include <limits>
#include <numeric>
#include <vector>

namespace io_suite {

using namespace ductile;
using namespace ductile::io;
namespace fs = std::filesystem;

namespace {

/// A padded array: rows x columns values of its own at the beginning of rows of `stride` values.
struct Padded {
    Padded(int rows, int columns, int stride)
        : values(static_cast<std::size_t>(rows * stride)), view_{nullptr, rows, columns, stride} {
        std::iota(values.begin(), values.end(), 1.0);
    }
    MutableArrayView view() { return {values.data(), view_.rows, view_.columns, view_.stride}; }
    std::vector<double> values;

private:
    MutableArrayView view_;
};

Checkpoint small_checkpoint(const ArrayView& array) {
    return {.program = "shear_band",
            .format = 3,
            .config = "dt = 0.5\n",
            .scalars = {{"time_s", 1.25}},
            .counters = {{"step", 7}, {"cells_x", 128}, {"cells_y", 64}},
            .arrays = {{"stress/p", array}}};
}

} // namespace

/// HDF5 loses a few kilobytes for each file whose last writes fail; the address sanitizer is not to stop at that.
extern "C" const char* __lsan_default_suppressions();
extern "C" const char* __lsan_default_suppressions() { return "leak:libhdf5"; }

TEST_SUITE_BEGIN("io");

TEST_CASE("HDF5 datasets come back from and to padded views, and padding is left alone") {
    const scratch::Folder folder;
    Padded written(3, 5, 8), read(3, 5, 6);
    const std::vector<double> before = read.values;
    const std::vector<std::int64_t> integers = {1, -2, std::numeric_limits<std::int64_t>::max()};
    {
        Hdf5File file = Hdf5File::create(folder / "a.h5");
        file.write("deep/group/array", written.view());
        file.write("integers", integers);
        file.write("text", std::string("τ = 1"));
        file.set_attribute("deep", "units", std::string("Pa"));
        file.set_attribute("/", "half", 0.5);
        file.close();
    }
    const Hdf5File file = Hdf5File::open(folder / "a.h5");
    file.read("deep/group/array", read.view());
    for (int j = 0; j < 3; ++j)
        for (int i = 0; i < 6; ++i)
            CHECK(read.view().row(j)[i] == (i < 5 ? written.view().row(j)[i] : before[static_cast<std::size_t>(6 * j + i)]));
    CHECK(file.read_integers("integers") == integers);
    CHECK(file.read_text("text") == "τ = 1");
    CHECK(file.text_attribute("deep", "units") == "Pa");
    CHECK(file.double_attribute("/", "half") == 0.5);
    CHECK(file.members("/") == std::vector<std::string>{"deep", "integers", "text"});
}

TEST_CASE("HDF5 writing converts units and repeats the periodic column, also in several batches of rows") {
    const scratch::Folder folder;
    const int rows = 700, columns = 511;
    Padded written(rows, columns, 520), read(rows, columns + 1, columns + 1);
    Hdf5File file = Hdf5File::create(folder / "a.h5");
    file.write("array", written.view(), {.scale = 2.0, .offset = 1.0, .repeat_first_column = true});
    file.read("array", read.view());
    bool right = true;
    for (int j = 0; j < rows; ++j)
        for (int i = 0; i <= columns; ++i)
            right &= read.view().row(j)[i] == 2.0 * written.view().row(j)[i % columns] + 1.0;
    CHECK(right);
}

TEST_CASE("reading what is not there or not right is an InputError that names file and object") {
    const scratch::Folder folder;
    Padded array(3, 5, 5), wrong(5, 3, 3);
    Hdf5File made = Hdf5File::create(folder / "a.h5");
    made.write("array", array.view());
    made.close();

    const Hdf5File file = Hdf5File::open(folder / "a.h5");
    CHECK(contains(message_of<InputError>([&] { file.read("none", array.view()); }), "a.h5: 'none' is missing"));
    CHECK(contains(message_of<InputError>([&] { file.read("array", wrong.view()); }), "'array' is 3 x 5 values, expected 5 x 3"));
    CHECK(contains(message_of<InputError>([&] { (void)file.read_doubles("array"); }), "'array' has 2 dimensions, expected 1"));
    CHECK(contains(message_of<InputError>([&] { (void)file.read_text("array"); }), "cannot read 'array' as text"));
    CHECK(contains(message_of<InputError>([&] { (void)file.double_attribute("array", "units"); }),
                   "attribute 'units' of 'array' is missing"));
    CHECK(contains(message_of<InputError>([&] { (void)file.members("array"); }), "group 'array' is missing"));

    CHECK(contains(message_of<InputError>([&] { (void)Hdf5File::open(folder / "b.h5"); }), "b.h5: there is no such file"));
    // claims that would take memory, or write beyond it
    const hid_t claims = H5Fcreate((folder / "claims.h5").c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
    const hsize_t many[] = {hsize_t{1} << 40, 3};
    const hid_t column = H5Screate_simple(1, many, nullptr), table = H5Screate_simple(2, many, nullptr);
    const hid_t three = H5Screate_simple(1, many + 1, nullptr);
    H5Dclose(H5Dcreate2(claims, "column", H5T_NATIVE_DOUBLE, column, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT));
    H5Dclose(H5Dcreate2(claims, "table", H5T_NATIVE_DOUBLE, table, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT));
    H5Aclose(H5Acreate2(claims, "three", H5T_NATIVE_DOUBLE, three, H5P_DEFAULT, H5P_DEFAULT));
    for (const hid_t space : {column, table, three})
        H5Sclose(space);
    H5Fclose(claims);
    const Hdf5File claiming = Hdf5File::open(folder / "claims.h5");
    CHECK(contains(message_of<InputError>([&] { (void)claiming.read_doubles("column"); }), "claims 1099511627776 values"));
    CHECK(contains(message_of<InputError>([&] { (void)claiming.shape("table"); }), "claims 1099511627776 x 3 values"));
    CHECK(contains(message_of<InputError>([&] { (void)claiming.double_attribute("/", "three"); }),
                   "'three' of '/' is not one value"));
    CHECK(contains(message_of<InputError>([&] { (void)claiming.text_attribute("/", "three"); }),
                   "'three' of '/' is not one value"));

    scratch::write(folder / "text.h5", "this is text, and long enough to be looked at twice");
    CHECK(contains(message_of<InputError>([&] { (void)Hdf5File::open(folder / "text.h5"); }), "not an HDF5 file"));
    fs::copy_file(folder / "a.h5", folder / "short.h5");
    fs::resize_file(folder / "short.h5", fs::file_size(folder / "a.h5") / 2);
    CHECK(contains(message_of<InputError>([&] { (void)Hdf5File::open(folder / "short.h5"); }), "truncated"));
}

TEST_CASE("HDF5 writing without room or folder is a RunError") {
    const scratch::Folder folder;
    CHECK(contains(message_of<RunError>([&] { (void)Hdf5File::create(folder / "none/a.h5"); }), "cannot write a new file"));
    Padded array(100, 100, 100);
    Hdf5File file = Hdf5File::create(folder / "a.h5");
    const scratch::FileSizeLimit limit(4096);
    CHECK(contains(message_of<RunError>([&] {
                       file.write("array", array.view());
                       file.close();
                   }),
                   "a.h5: cannot write"));
}

TEST_CASE("a full disk that shows only when the file is closed is a RunError, too") {
    const scratch::Folder folder;
    Hdf5File file = Hdf5File::create(folder / "a.h5");
    for (int i = 0; i < 50; ++i)
        file.create_group("group" + std::to_string(i));
    const scratch::FileSizeLimit limit(4096);
    CHECK(contains(message_of<RunError>([&] { file.close(); }), "a.h5: cannot write the file"));
}

TEST_CASE("an atomic file replaces the earlier one whole or not at all") {
    const scratch::Folder folder;
    write_text_atomically(folder / "a.txt", "first");
    write_text_atomically(folder / "a.txt", "second");
    CHECK(scratch::read(folder / "a.txt") == "second");
    {
        const AtomicFile abandoned(folder / "a.txt");
        scratch::write(abandoned.temporary_path(), "third");
    }
    {
        const scratch::FileSizeLimit limit(1000);
        CHECK(contains(message_of<RunError>([&] { write_text_atomically(folder / "a.txt", std::string(5000, 'x')); }),
                       "a.txt: cannot write"));
    }
    CHECK(scratch::read(folder / "a.txt") == "second");
    CHECK_FALSE(fs::exists(folder / "a.txt.tmp"));
}

TEST_CASE("a new run moves an earlier one aside, a continued run stays") {
    const scratch::Folder folder;
    const fs::path out = folder / "deep/out";
    { CHECK_FALSE(OutputFolder(out).earlier_run_moved_to()); }
    { CHECK_FALSE(OutputFolder(out).earlier_run_moved_to()); } // empty: nothing to keep
    for (const char* file : {"summary.json", "history.csv.partial"}) {
        scratch::write(out / file, "earlier");
        const OutputFolder second(out.string() + "/");
        REQUIRE(second.earlier_run_moved_to());
        CHECK(scratch::read(*second.earlier_run_moved_to() / file) == "earlier");
        CHECK(fs::is_empty(out));
    }
    CHECK(fs::exists(folder / "deep/out.1/summary.json"));
    CHECK(fs::exists(folder / "deep/out.2/history.csv.partial"));

    scratch::write(out / "checkpoint.h5", "checkpoint");
    {
        const OutputFolder continued(out, out / "checkpoint.h5");
        CHECK(continued.continued());
        CHECK(fs::exists(continued.checkpoint()));
    }
    fs::create_directory(out / "old");
    scratch::write(out / "old/checkpoint.h5", "checkpoint");
    CHECK(
        contains(message_of<InputError>([&] { OutputFolder(out, out / "old/checkpoint.h5"); }), "together with the checkpoint"));
}

TEST_CASE("an impossible output folder is an InputError that names it") {
    const scratch::Folder folder;
    scratch::write(folder / "file", "");
    CHECK(contains(message_of<InputError>([&] { OutputFolder(folder / "file"); }), "file: this is not a folder"));
    CHECK(contains(message_of<InputError>([&] { OutputFolder(folder / "file/below"); }), "file/below: cannot be made"));
    CHECK(contains(message_of<InputError>([&] { OutputFolder("/proc/ductile"); }), "/proc/ductile: cannot be made"));
    CHECK(contains(message_of<InputError>([&] { OutputFolder("/proc"); }), "/proc: files cannot be written there"));
    const OutputFolder busy(folder / "out");
    CHECK(contains(message_of<InputError>([&] { OutputFolder(folder / "out"); }), "another run is writing there"));
}

TEST_CASE("a checkpoint gives every bit back") {
    const scratch::Folder folder;
    Padded array(4, 3, 8), back(4, 3, 3);
    array.values[0] = -0.0;
    array.values[1] = std::numeric_limits<double>::denorm_min();
    array.values[2] = std::bit_cast<double>(0x7ff4'0000'dead'beefULL); // a signalling NaN with a payload
    const std::vector<double> vector = {array.values[2], array.values[0]};
    const std::vector<std::int64_t> integers = {5, -5};
    const HistoryMark mark{.columns = "time_s,stress_Pa", .rows = 2, .bytes = 30, .checksum = 0xfedc'ba98};
    Checkpoint checkpoint = small_checkpoint(array.view());
    checkpoint.scalars["quiet nan"] = std::bit_cast<double>(0x7ff8'0000'0000'0123ULL);
    checkpoint.vectors = {{"x", vector}};
    checkpoint.integer_vectors = {{"cell", integers}};
    checkpoint.history = mark;
    write_checkpoint(folder / "c.h5", checkpoint);

    const CheckpointReader reader(folder / "c.h5", "shear_band", 3);
    reader.read_array("stress/p", back.view());
    const auto bits = [](double value) { return std::bit_cast<std::uint64_t>(value); };
    for (int j = 0; j < 4; ++j)
        for (int i = 0; i < 3; ++i)
            CHECK(bits(back.view().row(j)[i]) == bits(array.view().row(j)[i]));
    CHECK(bits(reader.scalar("quiet nan")) == 0x7ff8'0000'0000'0123ULL);
    CHECK(bits(reader.vector("x")[0]) == bits(vector[0]));
    CHECK(bits(reader.vector("x")[1]) == bits(-0.0));
    CHECK(reader.integer_vector("cell") == integers);
    CHECK(reader.config() == "dt = 0.5\n");
    CHECK(reader.counter("step") == 7);
    CHECK(reader.history().mark == mark);
    CHECK(reader.history().csv == folder / "history.csv");
}

TEST_CASE("a checkpoint with any byte changed, cut off, moved or added is refused by name") {
    const scratch::Folder folder;
    Padded array(4, 3, 3);
    const fs::path path = folder / "c.h5", bad = folder / "bad.h5";
    write_checkpoint(path, small_checkpoint(array.view()));
    const std::string good = scratch::read(path);
    const auto refusal = [&](const std::string& bytes) {
        scratch::write(bad, bytes);
        return message_of<InputError>([&] { CheckpointReader(bad, "shear_band", 3); });
    };
    for (std::size_t at = 0; at < good.size(); ++at) {
        std::string damaged = good;
        damaged[at] = static_cast<char>(damaged[at] ^ (1 << at % 8));
        CHECK(contains(refusal(damaged), "bad.h5: this checkpoint is damaged") !=
              contains(refusal(damaged), "bad.h5: this is not a checkpoint, or not a whole one"));
    }
    for (std::size_t length = 0; length < good.size(); length += 97)
        CHECK(contains(refusal(good.substr(0, length)), "bad.h5: "));
    CHECK(contains(refusal(good + "x"), "bad.h5: "));
    CHECK(
        contains(refusal(good.substr(0, 512) + good.substr(1024, 512) + good.substr(512, 512) + good.substr(1536)), "bad.h5: "));
    { // edited by another program: HDF5 cuts off what is not its own
        scratch::write(bad, good);
        Hdf5File file = Hdf5File::open_for_append(bad);
        file.set_attribute("/", "remark", std::string("edited"));
        file.close();
    }
    CHECK(contains(message_of<InputError>([&] { CheckpointReader(bad, "shear_band", 3); }), "bad.h5: this is not a checkpoint"));
    scratch::write(bad, good);
    CHECK(CheckpointReader(bad, "shear_band", 3).counter("step") == 7);
    // CRC-32 of the standard's check string
    CHECK(checksum("123456789") == 0xcbf4'3926);
}

TEST_CASE("a checkpoint that does not fit says what, where and what to do") {
    const scratch::Folder folder;
    Padded array(4, 3, 3), wrong(3, 4, 4);
    const fs::path path = folder / "c.h5";
    write_checkpoint(path, small_checkpoint(array.view()));
    CHECK(contains(message_of<InputError>([&] { CheckpointReader(path, "upsetting", 3); }),
                   "written by shear_band, not by upsetting"));
    CHECK(contains(message_of<InputError>([&] { CheckpointReader(path, "shear_band", 4); }), "has format 3"));
    const CheckpointReader reader(path, "shear_band", 3);
    CHECK(contains(message_of<InputError>([&] { reader.read_array("stress/p", wrong.view()); }), "'stress/p' has 4 x 3 values"));
    CHECK(contains(message_of<InputError>([&] { reader.read_array("stress/q", wrong.view()); }), "'arrays/stress/q' is missing"));
    CHECK(contains(message_of<InputError>([&] { (void)reader.scalar("dt"); }), "attribute 'dt' of 'scalars' is missing"));
    Checkpoint odd = small_checkpoint(array.view());
    odd.counters = {{"step", std::numeric_limits<std::int64_t>::max()}, {"cells_x", -2}};
    write_checkpoint(folder / "odd.h5", odd);
    const CheckpointReader odd_reader(folder / "odd.h5", "shear_band", 3);
    for (const char* name : {"step", "cells_x"})
        CHECK(contains(message_of<InputError>([&] { (void)odd_reader.counter(name); }), "which no run counts to"));
    CHECK(contains(message_of<InputError>([&] {
                       reader.require_cells({64, 64});
                   }),
                   "holds a grid of 128 x 64 cells, the run has 64 x 64: use --cells 128x64"));
    Hdf5File other = Hdf5File::create(folder / "other.h5");
    other.close();
    seal(folder / "other.h5");
    CHECK(contains(message_of<InputError>([&] { CheckpointReader(folder / "other.h5", "shear_band", 3); }),
                   "this is not a checkpoint"));
}

TEST_CASE("a checkpoint that cannot be written leaves the earlier one intact") {
    const scratch::Folder folder;
    Padded array(100, 100, 100);
    write_checkpoint(folder / "c.h5", small_checkpoint(array.view()));
    const std::string before = scratch::read(folder / "c.h5");
    for (const rlim_t bytes : {0, 1000, 20'000, 79'000}) {
        const scratch::FileSizeLimit limit(bytes);
        CHECK(contains(message_of<RunError>([&] { write_checkpoint(folder / "c.h5", small_checkpoint(array.view())); }),
                       "cannot write"));
    }
    CHECK(scratch::read(folder / "c.h5") == before);
    CHECK_FALSE(fs::exists(folder / "c.h5.tmp"));
    write_checkpoint(folder / "c.h5", small_checkpoint(array.view())); // and the next one succeeds
}

TEST_SUITE_END();

} // namespace io_suite
