// An agent_handler of several hosts: nothing is acknowledged that only its disk has.

#include <gtest/gtest.h>

#include "agent_handler/link_test_world.h"
#include "messages/catch_up_messages.h"
#include "messages/channels.h"

namespace pangea {
namespace {

class Replicated : public LinkWorld {
 protected:
  void SetUp() override {
    handler_options.replicated = true;
    LinkWorld::SetUp();
    bridge_.Listen<journal_file_t>(channels::kJournalFile, [this](const JournalFile& file) {
      replicated_ = stores_ ? file : replicated_;
      if (speaks_) {
        bridge_.Publish(std::string(channels::kJournalReplicated), ToMessage(replicated_));
      }
    });
  }

  Node bridge_{server_bus, "bridge"};
  JournalFile replicated_;
  bool speaks_ = true;
  bool stores_ = true;
};

TEST_F(Replicated, KeyframesAreAcknowledgedOnceTheyAreReplicated) {
  Run(2);
  stores_ = false;
  PublishKeyframes(8);
  Run(5);
  ExpectDelivered(8);
  EXPECT_EQ(acknowledged, -1);
  stores_ = true;
  Run(3);
  EXPECT_EQ(acknowledged, 7);
}

TEST_F(Replicated, ARestartedHandlerAcknowledgesOnlyWhatIsReplicated) {
  Run(2);
  PublishKeyframes(5);
  Run(5);
  EXPECT_EQ(acknowledged, 4);
  stores_ = false;
  PublishKeyframes(5);
  Run(5);
  KillHandler();
  StartHandler();
  Run(5);
  EXPECT_EQ(acknowledged, 4);
  stores_ = true;
  Run(5);
  EXPECT_EQ(acknowledged, 9);
}

TEST_F(Replicated, AKeyThatComesBackWhileKeyframesAwaitReplicationIsServed) {
  Run(2);
  stores_ = false;
  PublishKeyframes(5);
  Run(5);
  const std::filesystem::path elsewhere = folder / "key";
  std::filesystem::rename(KeyFile(1), elsewhere);
  Run(5);
  std::filesystem::rename(elsewhere, KeyFile(1));
  Run(10);
  EXPECT_EQ(acknowledged, -1);
  stores_ = true;
  Run(10);
  EXPECT_EQ(acknowledged, 4);
  ExpectDelivered(5);
}

// Another host may have the site by then.
TEST_F(Replicated, NobodyIsAnsweredWhileTheBridgeIsSilent) {
  Run(2);
  PublishKeyframes(5);
  Run(5);
  speaks_ = false;
  Run(2);
  int answers = 0;
  link_bus.Subscribe(std::string(channels::kAllLinkDowns),
                     [&](const std::string&, Bytes) { ++answers; });
  PublishKeyframes(5);
  Run(5);
  EXPECT_EQ(answers, 0);
  EXPECT_EQ(acknowledged, 4);
  speaks_ = true;
  Run(5);
  EXPECT_EQ(acknowledged, 9);
  ExpectDelivered(10);
}

}  // namespace
}  // namespace pangea
