#include "link/agent_key.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>

namespace pangea {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

class AgentKeyTest : public testing::Test {
 protected:
  void SetUp() override {
    fs::remove_all(folder);
    fs::create_directories(folder);
  }
  void TearDown() override { fs::remove_all(folder); }
  fs::path Write(const std::string& name, const std::string& text) const {
    fs::path file = folder / name;
    std::ofstream(file) << text;
    fs::permissions(file, fs::perms::owner_read | fs::perms::owner_write);
    return file;
  }

  const fs::path folder = testing::TempDir() + "pangea_keys_" + std::to_string(getpid());
};

std::string ReasonOf(const std::function<void()>& call) {
  try {
    call();
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  return "";
}

TEST_F(AgentKeyTest, RoundTrip) {
  const fs::path a = folder / "a.key", b = folder / "b.key";
  MakeKeyFile(a, 4);
  MakeKeyFile(b, 5);
  EXPECT_EQ(fs::status(a).permissions(), fs::perms::owner_read | fs::perms::owner_write);
  EXPECT_EQ(ReadKeyFile(a).agent_id, 4);
  EXPECT_TRUE(ReadKeyFileOf(a, 4) == ReadKeyFile(a).key);
  EXPECT_FALSE(ReadKeyFile(a).key == ReadKeyFile(b).key);
  EXPECT_EQ(ReadKeyFile(a).anchors, AnchorRight::kEditOwn);
  EXPECT_THAT(ReasonOf([&] { ReadKeyFileOf(a, 7); }),
              testing::AllOf(HasSubstr("a.key"), HasSubstr("agent 4"), HasSubstr("agent 7")));
}

TEST_F(AgentKeyTest, NeverWritesOver) {
  const fs::path file = folder / "a.key";
  MakeKeyFile(file, 4);
  const SecretKey key = ReadKeyFile(file).key;
  EXPECT_THAT(ReasonOf([&] { MakeKeyFile(file, 4); }), HasSubstr("exists already"));
  EXPECT_TRUE(ReadKeyFile(file).key == key);
}

TEST_F(AgentKeyTest, MistakesGetAnAnswerWithoutTheSecret) {
  const std::string good(64, 'a');
  EXPECT_THAT(ReasonOf([&] { ReadKeyFile(folder / "none.key"); }), HasSubstr("keygen"));
  const fs::path open = Write("open.key", "agent: 4\nkey: " + good + "\n");
  EXPECT_EQ(ReasonOf([&] { ReadKeyFile(open); }), "");
  fs::permissions(open, fs::perms::group_read, fs::perm_options::add);
  EXPECT_THAT(ReasonOf([&] { ReadKeyFile(open); }), HasSubstr("chmod 600"));
  for (const auto& [text, said] :
       {std::pair{"agent: 4\n", "key:"}, std::pair{"agent: 4\nkey: 12345\n", "hexadecimal"},
        std::pair{"agent: 0\n", "1 .. 65535"}, std::pair{"agent: 4x\n", "1 .. 65535"},
        std::pair{"agents: 4\n", "agent:"}}) {
    EXPECT_THAT(ReasonOf([&, text = text] { ReadKeyFile(Write("bad.key", text)); }),
                testing::AllOf(HasSubstr("bad.key"), HasSubstr(said)));
  }
  EXPECT_THAT(ReasonOf([&] { ReadKeyFile(Write("long.key", std::string(5000, '#'))); }),
              HasSubstr("too long"));
  EXPECT_THAT(ReasonOf([&] { ReadKeyFile(folder); }), HasSubstr("is not a file"));
  const uid_t user = geteuid();
  fs::permissions(open, fs::perms::none);
  ASSERT_TRUE(user != 0 || seteuid(65534) == 0) << "root may read everything";
  const std::string denied = ReasonOf([&] { ReadKeyFile(open); });
  ASSERT_EQ(seteuid(user), 0);
  EXPECT_THAT(denied, testing::AllOf(HasSubstr("denied: give it to the user"),
                                     testing::Not(HasSubstr("keygen"))));
  const std::string secret(63, 'b');
  EXPECT_THAT(ReasonOf([&] { ReadKeyFile(Write("bad.key", "agent: 4\nkey: " + secret + "\n")); }),
              testing::Not(HasSubstr("bbbb")));
}

TEST_F(AgentKeyTest, WhatItAllowsWithAnchors) {
  for (const AnchorRight right :
       {AnchorRight::kRead, AnchorRight::kEditOwn, AnchorRight::kEditAll}) {
    const fs::path file = folder / "a.key";
    fs::remove(file);
    MakeKeyFile(file, 4, right);
    EXPECT_EQ(ReadKeyFile(file).anchors, right);
  }
  const std::string key = "agent: 4\nkey: " + std::string(64, 'a') + "\n";
  EXPECT_EQ(ReadKeyFile(Write("a.key", key)).anchors, AnchorRight::kEditOwn) << "as made before";
  EXPECT_EQ(ReadKeyFile(Write("a.key", key + "anchors: write\n")).anchors, AnchorRight::kEditAll);
  EXPECT_THAT(ReasonOf([&] { ReadKeyFile(Write("bad.key", key + "anchors: all\n")); }),
              testing::AllOf(HasSubstr("bad.key"), HasSubstr("\"anchors: all\""),
                             HasSubstr("make it read")));
}

TEST_F(AgentKeyTest, AFolderOfKeys) {
  EXPECT_THAT(ReasonOf([&] { KeyFolder(folder / "none").Read(); }), HasSubstr("keygen"));
  KeyFolder keys(folder);
  EXPECT_TRUE(keys.Read().empty());
  EXPECT_FALSE(keys.Changed());
  MakeKeyFile(folder / "agent_4.key", 4);
  Write("readme.txt", "no key");
  EXPECT_TRUE(keys.Changed());
  EXPECT_THAT(keys.Read(), testing::ElementsAre(testing::Key(4)));
  EXPECT_FALSE(keys.Changed());
  MakeKeyFile(folder / "again.key", 4);
  EXPECT_TRUE(keys.Read().at(4).key == ReadKeyFile(folder / "agent_4.key").key);
  EXPECT_THAT(keys.unusable(), testing::ElementsAre(testing::AllOf(
                                   HasSubstr("again.key"), HasSubstr("second key of agent 4"))));
  EXPECT_TRUE(keys.Changed()) << "until it is mended";
  fs::remove(folder / "again.key");
  keys.Read();
  EXPECT_FALSE(keys.Changed());
  fs::remove(folder / "agent_4.key");
  EXPECT_TRUE(keys.Changed());
  EXPECT_TRUE(keys.Read().empty());
}

TEST_F(AgentKeyTest, AFolderOfKeysWithABadFile) {
  KeyFolder keys(folder);
  MakeKeyFile(folder / "agent_4.key", 4);
  EXPECT_THAT(keys.Read(), testing::ElementsAre(testing::Key(4)));
  Write("agent_3.key", "");
  MakeKeyFile(folder / "agent_10.key", 10);
  EXPECT_THAT(keys.Read(), testing::ElementsAre(testing::Key(4), testing::Key(10)));
  EXPECT_THAT(keys.unusable(), testing::ElementsAre(HasSubstr("agent_3.key: is no key file")));
  EXPECT_TRUE(keys.Changed()) << "until it is mended; chmod leaves no newer time";
  fs::remove(folder / "agent_3.key");

  const SecretKey last = ReadKeyFile(folder / "agent_4.key").key;
  Write("agent_4.key", "agent: 4\nkey: 12");
  EXPECT_TRUE(keys.Read().at(4).key == last) << "it may be half written";
  EXPECT_THAT(keys.unusable(), testing::ElementsAre(HasSubstr("agent_4.key")));
  EXPECT_THAT(KeyFolder(folder).Read(), testing::ElementsAre(testing::Key(10))) << "at a start";
  fs::remove(folder / "agent_4.key");
  EXPECT_THAT(keys.Read(), testing::ElementsAre(testing::Key(10)));
  EXPECT_FALSE(keys.Changed());
}

}  // namespace
}  // namespace pangea
