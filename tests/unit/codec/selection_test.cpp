#include "sdk/core/codec/selection.hpp"

#include <gtest/gtest.h>

#include <vector>

namespace tandem {
namespace {

std::vector<std::byte> bytes_of(std::initializer_list<int> values) {
  std::vector<std::byte> bytes;
  for (const int value : values) bytes.push_back(static_cast<std::byte>(value));
  return bytes;
}

Result<std::vector<Slot>> parse(SelectionForm form, const std::vector<std::byte>& bytes,
                                std::vector<std::uint8_t> alive) {
  std::vector<Slot> slots(alive.size());
  ByteReader in(bytes);
  const auto count =
      parse_selection(form, {0, 0, static_cast<std::uint32_t>(alive.size())}, alive, in, slots);
  if (!count) return tl::unexpected<Error>(count.error());
  if (!in.at_end()) return fail(ErrorCode::kMalformed, "not consumed");
  slots.resize(*count);
  return slots;
}

TEST(Selection, TheFormWithTheFewestBytesIsTaken) {
  EXPECT_EQ(smallest_form(16384, 1, 16384), SelectionForm::kList);
  EXPECT_EQ(smallest_form(16384, 1023, 16384), SelectionForm::kList);
  EXPECT_EQ(smallest_form(16384, 1024, 16384), SelectionForm::kMask);
  EXPECT_EQ(smallest_form(16384, 7, 7), SelectionForm::kAll);
  EXPECT_EQ(smallest_form(10, 1, 9), SelectionForm::kMask);
}

TEST(Selection, BlocksCoverTheCapacity) {
  EXPECT_EQ(block_at(0, 10).slots, 10U);
  EXPECT_EQ(block_at(1, kBlockSlots + 3).first, kBlockSlots);
  EXPECT_EQ(block_at(1, kBlockSlots + 3).slots, 3U);
}

TEST(Selection, EveryFormReadsBackWhatWasWritten) {
  const Block block{1, kBlockSlots, 20};
  std::vector<std::uint8_t> alive(kBlockSlots + 20, 0);
  const std::vector<Slot> chosen{kBlockSlots, kBlockSlots + 7, kBlockSlots + 8, kBlockSlots + 19};
  for (const Slot slot : chosen) alive[slot] = 1;
  for (const auto form : {SelectionForm::kList, SelectionForm::kMask, SelectionForm::kAll}) {
    std::vector<std::byte> memory(100);
    ByteWriter out(memory);
    write_selection(form, block, chosen, out);
    EXPECT_EQ(out.size(), selection_bytes(form, block.slots, 4));
    ByteReader in(out.written());
    std::vector<Slot> slots(20);
    const auto count = parse_selection(form, block, alive, in, slots);
    ASSERT_TRUE(count);
    slots.resize(*count);
    EXPECT_EQ(slots, chosen);
    EXPECT_TRUE(in.at_end());
  }
}

TEST(Selection, AListMustAscendWithinTheBlockOverAliveSlots) {
  const std::vector<std::uint8_t> alive{1, 1, 0, 1};
  EXPECT_TRUE(parse(SelectionForm::kList, bytes_of({2, 0, 0, 0, 3, 0}), alive));
  EXPECT_FALSE(parse(SelectionForm::kList, bytes_of({2, 0, 3, 0, 0, 0}), alive));  // descends
  EXPECT_FALSE(parse(SelectionForm::kList, bytes_of({2, 0, 1, 0, 1, 0}), alive));  // twice
  EXPECT_FALSE(parse(SelectionForm::kList, bytes_of({1, 0, 2, 0}), alive));        // dead
  EXPECT_FALSE(parse(SelectionForm::kList, bytes_of({1, 0, 4, 0}), alive));        // beyond
  EXPECT_FALSE(parse(SelectionForm::kList, bytes_of({0, 0}), alive));              // none
  EXPECT_FALSE(parse(SelectionForm::kList, bytes_of({5, 0, 0, 0}), alive));        // more than slots
  EXPECT_FALSE(parse(SelectionForm::kList, bytes_of({2, 0, 0, 0, 3}), alive));     // truncated
}

TEST(Selection, AMaskNamesAliveSlotsOfTheBlockOnly) {
  const std::vector<std::uint8_t> alive{1, 1, 0, 1};
  EXPECT_TRUE(parse(SelectionForm::kMask, bytes_of({0b1001}), alive));
  EXPECT_FALSE(parse(SelectionForm::kMask, bytes_of({0b0100}), alive));
  EXPECT_FALSE(parse(SelectionForm::kMask, bytes_of({0b10000}), alive));
  EXPECT_FALSE(parse(SelectionForm::kMask, bytes_of({0}), alive));
  EXPECT_FALSE(parse(SelectionForm::kMask, bytes_of({}), alive));
}

TEST(Selection, AllOfABlockWithoutBodiesIsRefused) {
  EXPECT_FALSE(parse(SelectionForm::kAll, {}, {0, 0}));
  EXPECT_FALSE(parse(static_cast<SelectionForm>(3), {}, {1, 1}));
}

}  // namespace
}  // namespace tandem
