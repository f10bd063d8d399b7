#include "gateway/admission.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <stdexcept>

#include "files/text_file.h"
#include "link/agent_key.h"

namespace pangea {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;
using testing::SizeIs;

constexpr int64_t kNow_s = 1'700'000'000;

class AdmissionTest : public testing::Test {
 protected:
  AdmissionTest() : admission_((fs::remove_all(folder_), site_ = site::OpenSite(folder_))) {}

  std::string Invite(const std::string& name = "", AnchorRight right = AnchorRight::kEditOwn) {
    return PlainJoinCode(admission_.Make({name, right, kNow_s + 60}));
  }
  JoinResult Join(const std::string& code, const std::string& name = "", int64_t now_s = kNow_s) {
    return admission_.Join({code, name}, now_s);
  }

  const fs::path folder_ = testing::TempDir() + "/admission";
  site::Site site_;
  Admission admission_;
};

TEST_F(AdmissionTest, ACodeIsGoodForOneKey) {
  const std::string code = Invite("Anna", AnchorRight::kEditAll);
  const JoinResult first = Join(code);
  ASSERT_EQ(first.status, 200) << first.error;
  EXPECT_EQ(first.agent_id, Admission::kFirstAgent);
  const AgentKey key = ReadKeyFile(site_.keys() / KeyFileName(first.agent_id));
  EXPECT_EQ(ToHex(key.key), first.key_hex);
  EXPECT_EQ(key.anchors, AnchorRight::kEditAll);
  EXPECT_EQ(admission_.Agents().at(first.agent_id).name, "Anna");
  EXPECT_EQ(admission_.Agents().at(first.agent_id).joined_s, kNow_s);

  const JoinResult replayed = Join(code);
  EXPECT_EQ(replayed.status, JoinResult::kWrongCode);
  EXPECT_EQ(replayed.key_hex, "");
  EXPECT_THAT(KeyFolder(site_.keys()).Read(), SizeIs(1));
}

TEST_F(AdmissionTest, TheVisitorsOwnNameCounts) {
  const JoinResult joined = Join(Invite("a guest"), "Ben");
  EXPECT_EQ(admission_.Agents().at(joined.agent_id).name, "Ben");
}

TEST_F(AdmissionTest, ACodeThatIsTooOldOrUnknownIsNone) {
  const std::string code = Invite();
  EXPECT_EQ(Join(code, "", kNow_s + 60).status, JoinResult::kWrongCode);
  EXPECT_EQ(Join("ABCDEFGHJKMNPQRS").status, JoinResult::kWrongCode);
  EXPECT_EQ(Join("../../keys/x").status, JoinResult::kWrongCode);
  EXPECT_THAT(admission_.Agents(), IsEmpty());
  EXPECT_EQ(Join(code, "", kNow_s + 59).status, 200);
}

TEST_F(AdmissionTest, TheCodeItselfIsNowhere) {
  const std::string code = admission_.Make({"Anna", AnchorRight::kRead, kNow_s + 60});
  for (const auto& entry : fs::recursive_directory_iterator(site_.gateway())) {
    EXPECT_THAT(entry.path().string(), Not(HasSubstr(PlainJoinCode(code))));
    if (entry.is_regular_file()) {
      EXPECT_THAT(ReadTextFile(entry.path()), Not(HasSubstr(code.substr(0, 4))));
      EXPECT_EQ(entry.status().permissions(), fs::perms::owner_read | fs::perms::owner_write);
    }
  }
  EXPECT_EQ(fs::status(site_.gateway()).permissions(), fs::perms::owner_all);
}

// A gateway that was killed after the key was made, and before the code was used up.
TEST_F(AdmissionTest, AKilledGatewayHandsOutNoSecondKey) {
  const std::string code = Invite();
  MakeKeyFile(site_.keys() / KeyFileName(Admission::kFirstAgent), Admission::kFirstAgent);
  const JoinResult joined = Join(code);
  EXPECT_EQ(joined.agent_id, Admission::kFirstAgent + 1) << "the lost key stays whoever's it is";
  EXPECT_EQ(Join(code).status, JoinResult::kWrongCode);
}

TEST_F(AdmissionTest, NobodyGetsTheIdOfAnother) {
  const JoinResult anna = Join(Invite());
  admission_.Revoke(anna.agent_id);
  EXPECT_THAT(KeyFolder(site_.keys()).Read(), IsEmpty());
  const JoinResult ben = Join(Invite());
  EXPECT_EQ(ben.agent_id, anna.agent_id + 1);
  EXPECT_THAT(admission_.Agents(), SizeIs(2));
  EXPECT_THROW(admission_.Revoke(anna.agent_id), std::runtime_error);
}

TEST_F(AdmissionTest, ADamagedFileCostsOnlyItself) {
  const std::string code = Invite();
  std::ofstream(site_.gateway() / "invites" / "torn.json") << R"({"name": "An)";
  std::ofstream(site_.gateway() / "agents" / "1001.json") << "[]";
  EXPECT_THAT(admission_.Invites(kNow_s), SizeIs(1));
  EXPECT_EQ(Join(code).agent_id, 1002);
}

TEST_F(AdmissionTest, OldInvitesAreRemoved) {
  Invite();
  EXPECT_THAT(admission_.Invites(kNow_s + 59), SizeIs(1));
  EXPECT_THAT(admission_.Invites(kNow_s + 60), IsEmpty());
  EXPECT_TRUE(fs::is_empty(site_.gateway() / "invites"));
}

TEST_F(AdmissionTest, ASiteHasSoManyKeys) {
  for (size_t i = 0; i < KeyFolder::kMaxKeys; ++i) {
    std::ofstream(site_.keys() / (std::to_string(i) + ".key")).flush();
  }
  const std::string code = Invite();
  EXPECT_EQ(Join(code).status, 503);
  fs::remove(site_.keys() / "0.key");
  EXPECT_EQ(Join(code).status, 200) << "the code was not used up";
}

}  // namespace
}  // namespace pangea
