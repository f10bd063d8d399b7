#pragma once

// What an LCM URL means to its users.

#include <string>

namespace pangea {

// Why several processes cannot share a bus with this URL; empty if they can. Checks it as LcmBus
// does when it opens it, but without a network.
std::string WhyNoBus(const std::string& url);
// Whether two URLs are of one bus: what follows a '?' does not count.
bool IsOneBus(const std::string& url, const std::string& other_url);
// Throws std::runtime_error if the URLs of two options are of one bus: what is relayed from one to
// the other would come back.
void RequireTwoBuses(const std::string& option, const std::string& url,
                     const std::string& other_option, const std::string& other_url);

}  // namespace pangea
