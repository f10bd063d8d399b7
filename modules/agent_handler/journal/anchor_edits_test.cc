#include "agent_handler/journal/anchor_edits.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <iterator>

#include "agent_handler/journal/archive.h"
#include "messages/channels.h"
#include "messages/encoding.h"
#include "messages/testing/test_anchors.h"
#include "messages/testing/test_keyframes.h"
#include "pangea/again_t.hpp"

namespace pangea {
namespace {

using Taken = AnchorEdits::Taken;

class AnchorEditsTest : public testing::Test {
 protected:
  void SetUp() override {
    std::filesystem::remove(path);
    bus.Subscribe("ANCHOR_EDIT",
                  [this](const std::string&, Bytes data) { published.push_back(Decoded(data)); });
    bus.Subscribe("AGAIN_anchors", [this](const std::string&, Bytes data) {
      again_t message{};
      ASSERT_TRUE(DecodeMessage(data, &message));
      EXPECT_EQ(message.channel, "ANCHOR_EDIT");
      again.push_back(Decoded(message.data));
    });
    Start();
  }
  void TearDown() override {
    archive.reset();
    std::filesystem::remove(path);
  }
  static AnchorEdit Decoded(Bytes data) {
    anchor_edit_t message{};
    EXPECT_TRUE(DecodeMessage(data, &message));
    return Parse(message).value.value();
  }
  void Start() {
    archive.reset();
    node.emplace(bus, "agent_handler");
    archive.emplace(*node, path, 1'700'000'000'000'000);
  }
  void Sync() {
    now += 1'000'000;
    archive->set_now_us(now);
    archive->Sync();
    archive->AnswerResendRequests();
    bus.Drain();
  }
  void Ask(int32_t from, int32_t to) {
    resend_request_t request{};
    request.requester = "anchors";
    request.channel = channels::kAnchorEdit;
    request.map = ToMessage(MapId{1, 1});
    request.from_seq = from;
    request.to_seq = to;
    PublishMessage(bus, std::string(channels::kResendRequest), request);
    bus.Drain();
    Sync();
  }
  static std::vector<int64_t> Seqs(const std::vector<AnchorEdit>& edits) {
    std::vector<int64_t> seqs;
    for (const AnchorEdit& edit : edits) {
      seqs.push_back(edit.seq);
    }
    return seqs;
  }

  const std::string path = testing::TempDir() + "pangea_edits_" + std::to_string(getpid());
  LocalBus bus;
  std::optional<Node> node;
  std::optional<Archive> archive;
  std::vector<AnchorEdit> published, again;
  int64_t now = 1'000'000;
};

TEST_F(AnchorEditsTest, EachIsNumberedAndJournalledOnceBeforeItIsPublished) {
  EXPECT_EQ(archive->Append(TestEdit({1, 5}, 1, 1)), Taken::kQueued);
  EXPECT_EQ(archive->Append(TestEdit({1, 5}, 1, 1)), Taken::kQueued);
  EXPECT_EQ(archive->Append(TestEdit({1, 5}, 1, 2)), Taken::kQueued) << "another editor";
  EXPECT_EQ(archive->Append(TestEdit({1, 5}, 2, 1)), Taken::kQueued);
  bus.Drain();
  EXPECT_TRUE(published.empty());
  EXPECT_TRUE(archive->TakeJournalledEdits().empty());
  Sync();
  EXPECT_EQ(Seqs(published), (std::vector<int64_t>{0, 1, 2}));
  EXPECT_EQ(Seqs(archive->TakeJournalledEdits()), (std::vector<int64_t>{0, 1, 2}));
  EXPECT_TRUE(archive->TakeJournalledEdits().empty());
  EXPECT_EQ(archive->Append(TestEdit({1, 5}, 1, 1)), Taken::kJournalled);
}

TEST_F(AnchorEditsTest, NumbersGoOnAfterARestart) {
  for (int i = 0; i < 20; ++i) {
    archive->Append(TestEdit({1, i}, 1, 1));
    archive->Append({{1, 1000}, i}, EncodeTestKeyframe({{1, 1000}, i}));
  }
  Sync();
  const std::vector<AnchorEdit> before = published;
  published.clear();
  Start();
  EXPECT_EQ(archive->num_keyframes(), 20);
  EXPECT_EQ(archive->Append(TestEdit({1, 7}, 1, 1)), Taken::kJournalled);
  EXPECT_EQ(archive->Append(TestEdit({1, 7}, 2, 1)), Taken::kQueued);
  Sync();
  EXPECT_EQ(Seqs(published), (std::vector<int64_t>{20}));
  Ask(5, 8);
  EXPECT_EQ(Seqs(again), (std::vector<int64_t>{5, 6, 7, 8}));
  EXPECT_EQ(EncodeMessage(ToMessage(again[2])), EncodeMessage(ToMessage(before[7])));
  again.clear();
  Ask(19, 9'000'000);
  EXPECT_EQ(Seqs(again), (std::vector<int64_t>{19, 20}));
  again.clear();
  Ask(21, 22);
  EXPECT_TRUE(again.empty());
}

TEST_F(AnchorEditsTest, AnchorsWithoutANameInTheJournalOfAnEarlierVersionStay) {
  AnchorEdit nameless = TestEdit({1, 5}, 1, 1);
  nameless.name.clear();
  archive->Append(nameless);
  Sync();
  Start();
  Ask(0, 0);
  ASSERT_EQ(again.size(), 1u);
  EXPECT_EQ(again[0].anchor, nameless.anchor);
  EXPECT_EQ(again[0].name, "");
}

TEST_F(AnchorEditsTest, TheNewestIsPublishedWithEachHave) {
  archive->PublishHave();
  bus.Drain();
  EXPECT_TRUE(published.empty());
  archive->Append(TestEdit({1, 5}, 1, 1));
  archive->Append(TestEdit({1, 6}, 1, 1));
  Sync();
  published.clear();
  archive->PublishHave();
  bus.Drain();
  EXPECT_EQ(Seqs(published), (std::vector<int64_t>{1}));
  Start();
  published.clear();
  archive->PublishHave();
  bus.Drain();
  EXPECT_EQ(Seqs(published), (std::vector<int64_t>{1})) << "also of a journal that is read";
}

// The numbers that damage has cost do not come again, and nobody has to ask for them for ever.
TEST_F(AnchorEditsTest, DamageLosesOnlyTheEditItHit) {
  for (int i = 0; i < 6; ++i) {
    archive->Append(TestEdit({1, i}, 1, 1));
    Sync();
  }
  archive.reset();
  std::fstream file(path, std::ios::in | std::ios::out | std::ios::binary);
  std::string bytes((std::istreambuf_iterator<char>(file)), {});
  const size_t at = bytes.find("kettle 1/2");
  ASSERT_NE(at, std::string::npos);
  file.clear();
  file.seekp(static_cast<std::streamoff>(at));
  file << "KETTLE";
  file.close();
  published.clear();
  Start();
  Ask(0, 5);
  ASSERT_EQ(Seqs(again), (std::vector<int64_t>{0, 1, 2, 3, 4, 5}));
  EXPECT_EQ(again[2].anchor, (AnchorId{1, 3})) << "the next one, twice";
  EXPECT_EQ(again[3].anchor, (AnchorId{1, 3}));
  EXPECT_EQ(archive->Append(TestEdit({1, 2}, 1, 1)), Taken::kQueued) << "its agent sends it again";
  Sync();
  EXPECT_EQ(Seqs(published), (std::vector<int64_t>{6}));
  for (const auto& entry : std::filesystem::directory_iterator(testing::TempDir())) {
    if (entry.path().string().starts_with(path + ".damaged")) {
      std::filesystem::remove(entry.path());
    }
  }
}

TEST_F(AnchorEditsTest, RequestsAreBounded) {
  for (int i = 0; i < 3; ++i) {
    archive->Append(TestEdit({1, i}, 1, 1));
  }
  Sync();
  resend_request_t request{};
  request.channel = channels::kAnchorEdit;
  request.map = ToMessage(MapId{1, 1});
  AnchorEdits edits(*node);
  EXPECT_EQ(edits.OnResendRequest(request), "resend request: requester, map or range is invalid");
  for (int i = 0; i < 200; ++i) {
    request.requester = "p" + std::to_string(i);
    request.to_seq = 2;
    PublishMessage(bus, std::string(channels::kResendRequest), request);
  }
  int answers = 0;
  bus.Subscribe("AGAIN_p.*", [&](const std::string&, Bytes) { ++answers; });
  bus.Drain();
  for (int i = 0; i < 20; ++i) {
    Sync();
  }
  EXPECT_EQ(answers, 3 * static_cast<int>(AnchorEdits::kMaxRequests));
}

}  // namespace
}  // namespace pangea
