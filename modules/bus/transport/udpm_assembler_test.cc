#include "bus/transport/udpm_assembler.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>

#include "bus/transport/test_datagrams.h"

namespace pangea {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::IsEmpty;
using testing::Key;
using testing::Pair;

const std::string kEnd(1, '\0');

struct Taken {
  std::string channel;
  std::string data;
  bool operator==(const Taken&) const = default;
};

std::optional<Taken> Take(UdpmAssembler& assembler, const Datagram& datagram, uint64_t sender = 1) {
  const auto message = assembler.Take(datagram, sender);
  return message
             ? std::optional(Taken{message->channel, {message->data.begin(), message->data.end()}})
             : std::nullopt;
}

// Cuts a message into fragments as LCM does.
std::vector<Datagram> Fragments(uint32_t message_number, const std::string& channel,
                                const std::string& data, size_t bytes) {
  const std::string whole = channel + kEnd + data;
  const size_t count = (whole.size() + bytes - 1) / bytes, head = channel.size() + 1;
  std::vector<Datagram> fragments;
  for (size_t i = 0; i < count; ++i) {
    const size_t begin = i * bytes;
    fragments.push_back(FragmentDatagram({message_number, static_cast<uint32_t>(data.size()),
                                          static_cast<uint32_t>(i == 0 ? 0 : begin - head),
                                          static_cast<uint16_t>(i), static_cast<uint16_t>(count)},
                                         whole.substr(begin, bytes)));
  }
  return fragments;
}

std::string Text(size_t bytes, int seed) {
  std::string text(bytes, ' ');
  std::mt19937 rng(static_cast<unsigned>(seed));
  std::ranges::generate(text, [&] { return static_cast<char>(rng()); });
  return text;
}

TEST(UdpmAssembler, TakesShortMessages) {
  UdpmAssembler assembler;
  EXPECT_EQ(Take(assembler, ShortDatagram("A" + kEnd + "data")), (Taken{"A", "data"}));
  EXPECT_EQ(Take(assembler, ShortDatagram("A" + kEnd)), (Taken{"A", ""}));
  const std::string longest(UdpmAssembler::kMaxChannel, 'C');
  EXPECT_EQ(Take(assembler, ShortDatagram(longest + kEnd + "x")), (Taken{longest, "x"}));
  EXPECT_THAT(assembler.refused(), IsEmpty());
}

TEST(UdpmAssembler, JoinsFragmentsInAnyOrder) {
  const std::string data = Text(5000, 1);
  std::vector<Datagram> fragments = Fragments(3, "LARGE", data, 700);
  ASSERT_EQ(fragments.size(), 8u);
  std::mt19937 rng(1);
  for (int round = 0; round < 50; ++round) {
    UdpmAssembler assembler;
    std::ranges::shuffle(fragments, rng);
    for (size_t i = 0; i + 1 < fragments.size(); ++i) {
      EXPECT_FALSE(Take(assembler, fragments[i]));
    }
    EXPECT_EQ(Take(assembler, fragments.back()), (Taken{"LARGE", data}));
    EXPECT_EQ(assembler.partials(), 0u);
    EXPECT_EQ(assembler.partial_bytes(), 0u);
    EXPECT_THAT(assembler.refused(), IsEmpty());
  }
}

TEST(UdpmAssembler, ARepeatedFragmentCountsOnce) {
  UdpmAssembler assembler;
  const std::string data = Text(1500, 1);
  const auto fragments = Fragments(3, "A", data, 700);
  ASSERT_EQ(fragments.size(), 3u);
  for (const size_t i : {0, 0, 0, 2, 2}) {
    EXPECT_FALSE(Take(assembler, fragments[i]));
  }
  EXPECT_EQ(Take(assembler, fragments[1]), (Taken{"A", data}));
  EXPECT_THAT(assembler.refused(), ElementsAre(Pair("fragment: repeated", 3)));
}

TEST(UdpmAssembler, SendersAndMessagesDoNotMix) {
  UdpmAssembler assembler;
  constexpr int kSenders = 5, kMessages = 3;
  struct Sent {
    uint64_t sender;
    std::vector<Datagram> fragments;
    Taken whole;
  };
  std::vector<Sent> all;
  for (int sender = 0; sender < kSenders; ++sender) {
    for (int message = 0; message < kMessages; ++message) {
      const Taken whole{"C" + std::to_string(sender), Text(2000, 10 * sender + message)};
      all.push_back({static_cast<uint64_t>(sender),
                     Fragments(static_cast<uint32_t>(message), whole.channel, whole.data, 300),
                     whole});
    }
  }
  for (size_t i = 0; i < all[0].fragments.size(); ++i) {
    for (const Sent& sent : all) {
      const auto taken = Take(assembler, sent.fragments[i], sent.sender);
      EXPECT_EQ(taken.has_value(), i + 1 == sent.fragments.size());
      EXPECT_TRUE(!taken || *taken == sent.whole);
    }
  }
  EXPECT_EQ(assembler.partials(), 0u);
}

TEST(UdpmAssembler, ASenderThatBeginsAnewIsHeard) {
  UdpmAssembler assembler;
  const std::string before = Text(1500, 1), after = Text(1500, 2);
  Take(assembler, Fragments(0, "A", before, 700)[0]);
  Take(assembler, Fragments(0, "A", before, 700)[1]);
  const auto fragments = Fragments(0, "A", after, 700);
  Take(assembler, fragments[0]);
  Take(assembler, fragments[1]);
  EXPECT_EQ(Take(assembler, fragments[2]), (Taken{"A", after}));
  EXPECT_THAT(assembler.refused(), ElementsAre(Pair("fragment: an earlier one says otherwise", 1)));
}

struct Malformed {
  Datagram datagram;
  const char* reason;
};

TEST(UdpmAssembler, RefusesEveryFieldThatDoesNotHold) {
  const std::string name = "A" + kEnd, data(100, 'x');
  const char* const kNoChannel = "datagram: no channel of 1 to 63 characters";
  const char* const kBeyond = "fragment: beyond its message";
  const char* const kCount = "fragment: its number is not below their count";
  const char* const kShort = "datagram: shorter than a header";
  const std::vector<Malformed> all = {
      {{}, kShort},
      {{'L', 'C', '0', '2', 0, 0, 0}, kShort},
      {{'L', 'C', '0', '3', 0, 0, 0, 0, 0, 0}, kShort},
      {{'L', 'C', '0', '4', 0, 0, 0, 0, 'A', 0}, "datagram: not of LCM"},
      {ShortDatagram(""), kNoChannel},
      {ShortDatagram(kEnd + data), kNoChannel},
      {ShortDatagram("A"), kNoChannel},
      {ShortDatagram(std::string(64, 'A') + kEnd), kNoChannel},
      {ShortDatagram(std::string(60'000, 'A')), kNoChannel},
      {FragmentDatagram({1, 200, 0, 0, 0}, name + data), kCount},
      {FragmentDatagram({1, 200, 0, 2, 2}, data), kCount},
      {FragmentDatagram({1, 200, 0, 0, 2}, data), kNoChannel},
      {FragmentDatagram({1, 200, 0, 0, 2}, kEnd + data), kNoChannel},
      {FragmentDatagram({1, 200, 0, 0, 2}, name), "fragment: empty"},
      {FragmentDatagram({1, 0, 0, 0, 1}, name), "fragment: empty"},
      {FragmentDatagram({1, 99, 0, 0, 2}, name + data), kBeyond},
      {FragmentDatagram({1, 200, 101, 1, 2}, data), kBeyond},
      {FragmentDatagram({1, 1000, UINT32_MAX - 49, 0, 2}, name + data), kBeyond},
      {FragmentDatagram({1, 1000, UINT32_MAX, 1, 2}, data), kBeyond},
      {FragmentDatagram({1, (16 << 20) + 1, 0, 0, 2}, name + data),
       "fragment: of a message beyond 16 MiB"},
      {FragmentDatagram({1, UINT32_MAX, UINT32_MAX - 100, 1, 2}, data),
       "fragment: of a message beyond 16 MiB"},
  };
  for (size_t i = 0; i < all.size(); ++i) {
    UdpmAssembler assembler;
    EXPECT_FALSE(Take(assembler, all[i].datagram)) << i;
    EXPECT_THAT(assembler.refused(), ElementsAre(Pair(all[i].reason, 1))) << i;
    EXPECT_EQ(assembler.partials(), 0u) << i;
  }
}

TEST(UdpmAssembler, RefusesFragmentsThatDoNotFitEachOther) {
  const std::string name = "A" + kEnd, data(100, 'x');
  const auto refuses = [](const std::vector<Datagram>& datagrams) {
    UdpmAssembler assembler;
    for (const Datagram& datagram : datagrams) {
      EXPECT_FALSE(Take(assembler, datagram));
    }
    EXPECT_THAT(assembler.refused(), ElementsAre(Pair("fragments that do not fit each other", 1)));
    EXPECT_EQ(assembler.partials(), 0u);
    EXPECT_EQ(assembler.partial_bytes(), 0u);
  };
  refuses({FragmentDatagram({1, 200, 0, 0, 2}, name + data),
           FragmentDatagram({1, 200, 50, 1, 2}, data)});  // overlap
  refuses({FragmentDatagram({1, 300, 0, 0, 2}, name + data),
           FragmentDatagram({1, 300, 200, 1, 2}, data)});  // a gap
  refuses({FragmentDatagram({1, 300, 0, 0, 2}, name + data),
           FragmentDatagram({1, 300, 100, 1, 2}, data)});  // an end that never comes
  refuses({FragmentDatagram({1, 200, 100, 0, 2}, name + data),
           FragmentDatagram({1, 200, 0, 1, 2}, data)});  // in the other order
  refuses({FragmentDatagram({1, 150, 0, 0, 3}, name + data),
           FragmentDatagram({1, 150, 50, 1, 3}, data)});  // more than the whole
}

TEST(UdpmAssembler, MalformedDatagramsLeaveNothingBehind) {
  UdpmAssembler assembler;
  const auto malformed = MalformedDatagrams("A");
  for (const Datagram& datagram : malformed) {
    EXPECT_FALSE(Take(assembler, datagram));
  }
  int64_t refused = 0;
  for (const auto& [reason, count] : assembler.refused()) {
    refused += count;
  }
  EXPECT_EQ(refused, static_cast<int64_t>(malformed.size()));
  EXPECT_EQ(assembler.partials(), 0u);
}

TEST(UdpmAssembler, MemoryIsBoundedAndTheOldestGoesFirst) {
  UdpmAssembler assembler;
  const std::string large(60'000, 'x');
  const auto first = Fragments(7, "KEPT", large + large, 65'000);
  ASSERT_EQ(first.size(), 2u);
  for (uint64_t sender = 0; sender < 2000; ++sender) {
    // A message whose fragments still arrive is not the oldest.
    EXPECT_FALSE(Take(assembler, first[0], 1'000'000));
    Take(assembler, FragmentDatagram({1, 16 << 20, 1, 1, 3}, large), sender);
    EXPECT_LE(assembler.partial_bytes(), UdpmAssembler::kMaxPartialBytes);
    EXPECT_LE(assembler.partials(), UdpmAssembler::kMaxPartials);
  }
  EXPECT_THAT(assembler.refused(), Contains(Key("message that lacked fragments too long")));
  EXPECT_EQ(Take(assembler, first[1], 1'000'000), (Taken{"KEPT", large + large}));
}

TEST(UdpmAssembler, TheNumberOfPartialMessagesIsBounded) {
  UdpmAssembler assembler;
  for (uint32_t number = 0; number < 5000; ++number) {
    Take(assembler, FragmentDatagram({number, 16 << 20, 1, 1, 65'535}, "x"));
  }
  EXPECT_EQ(assembler.partials(), UdpmAssembler::kMaxPartials);
  EXPECT_LT(assembler.partial_bytes(), 1u << 20) << "what is announced takes no memory";
  EXPECT_THAT(assembler.refused(),
              ElementsAre(Pair("message that lacked fragments too long", 4000)));
}

TEST(UdpmAssembler, TheLargestMessageInTheMostFragmentsPasses) {
  UdpmAssembler assembler;
  const std::string data = Text(UdpmAssembler::kMaxMessage, 3);
  const auto fragments = Fragments(1, "A", data, 257);
  ASSERT_GT(fragments.size(), 65'000u);
  ASSERT_LE(fragments.size(), 65'535u);
  std::optional<Taken> taken;
  for (const Datagram& fragment : fragments) {
    ASSERT_FALSE(taken);
    taken = Take(assembler, fragment);
  }
  EXPECT_TRUE(taken == (Taken{"A", data}));
}

}  // namespace
}  // namespace pangea
