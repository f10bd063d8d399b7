#include "site/site_export.h"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>

#include "messages/encoding.h"
#include "messages/messages.h"
#include "site/site_test_world.h"

namespace pangea::site {
namespace {

TEST(SiteExport, HasTheAnchorsAmongThePoints) {
  std::vector<StoredEvent> events = WalksOf({1});
  keyframe_t first{};
  ASSERT_TRUE(DecodeMessage(events.front().data, &first));
  const KeyframeId keyframe{*Parse(first.id.map).value, 10};
  events.insert(events.begin(), OptionsEvent("anchors", "max_anchors: 1\n"));
  events.push_back(PlacementEvent({1, 5}, 0, keyframe, {2, 0, 0}));
  events.push_back(PlacementEvent({1, 6}, 1, keyframe, {3, 0, 0}));  // was refused
  const std::filesystem::path folder = FreshFolder("export");
  const Site site = MakeSite(folder / "hall", events);
  LogReadings readings;
  EXPECT_EQ(
      ExportSite(site, folder / "out", &readings),
      (std::vector<std::string>{folder / "out" / "agent_1.tum", folder / "out" / "map.ply",
                                folder / "out" / "anchors.json", folder / "out" / "map.gltf"}));
  std::ifstream anchors(folder / "out" / "anchors.json");
  const auto json = nlohmann::json::parse(anchors);
  ASSERT_EQ(json["anchors"].size(), 1u);
  EXPECT_EQ(json["anchors"][0]["name"], "kettle");
  EXPECT_EQ(json["anchors"][0]["state"], "placed");
  std::ifstream map(folder / "out" / "map.gltf");
  const auto gltf = nlohmann::json::parse(map);
  std::vector<std::string> names;
  for (const auto& node : gltf["nodes"]) {
    names.push_back(node.value("name", ""));
  }
  EXPECT_NE(std::find(names.begin(), names.end(), "kettle"), names.end());
  EXPECT_FALSE(gltf["meshes"].empty()) << "the points";
}

TEST(SiteExport, LeavesNothingWhenItFails) {
  const std::filesystem::path folder = FreshFolder("export_fails");
  std::vector<StoredEvent> events = WalksOf({1});
  std::erase_if(events,
                [](const StoredEvent& event) { return event.channel.starts_with("KEYFRAME"); });
  const Site site = MakeSite(folder / "hall", events);
  LogReadings readings;
  EXPECT_THROW(ExportSite(site, folder / "out", &readings), std::runtime_error);
  EXPECT_FALSE(std::filesystem::exists(folder / "out"));
}

// The kernel kills the child when a file of it grows beyond the limit: that of the replay is first.
TEST(SiteExport, IsNotInTheWayOfTheNextOneWhenItIsKilled) {
  const std::filesystem::path folder = FreshFolder("export_killed");
  const Site site = MakeSite(folder / "hall", WalksOf({1}));
  const pid_t child = fork();
  if (child == 0) {
    const rlimit limit{100'000, 100'000};
    setrlimit(RLIMIT_FSIZE, &limit);
    LogReadings readings;
    ExportSite(site, folder / "out", &readings);
    _exit(0);
  }
  int status = 0;
  waitpid(child, &status, 0);
  ASSERT_TRUE(WIFSIGNALED(status));
  LogReadings readings;
  EXPECT_EQ(ExportSite(site, folder / "out", &readings).size(), 2u);
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder / "out"),
                          std::filesystem::directory_iterator()),
            2);
  EXPECT_NE(WhyNot([&] { ExportSite(site, folder / "out", &readings); }), "");
}

}  // namespace
}  // namespace pangea::site
