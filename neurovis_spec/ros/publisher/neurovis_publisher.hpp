// Shows a controller in NeuroVis: publishes its activities, its weights and its spec, over roscpp (ROS 1).
//
// This file needs roscpp, std_msgs and C++11, and nothing of NeuroVis. In a controller:
//
//     #include "NAME_publisher.hpp"
//     neurovis::Publisher shown(node, neurovis::NAME_network());   // once, with its ros::NodeHandle
//     shown.publish(activity, weights);                           // in each step
//
// activity are the activities of all neurons in the order of the spec, weights those of the connections that learn, in
// their order, before the step: vectors, or pointers to as many numbers. Then 'neurovis ros view' shows the network.
#ifndef NEUROVIS_PUBLISHER_HPP
#define NEUROVIS_PUBLISHER_HPP

#include <ros/ros.h>
#include <std_msgs/Float64MultiArray.h>
#include <std_msgs/String.h>

#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <vector>

namespace neurovis {

// What is published of a network: its name, the hash and the text of its spec ("" where there is none), how many
// neurons it has, and how many connections that learn.
struct Network {
  std::string name;
  std::size_t neurons;
  std::size_t weights;
  std::string hash;
  std::string spec;
  std::string ns;
};

// Publishes a network. Throws std::invalid_argument for another number of values than it has.
class Publisher {
 public:
  Publisher(ros::NodeHandle &node, const Network &network) : network_(network), step_(0) {
    const std::string base = (network.ns == "/" ? "" : network.ns) + "/" + network.name;
    if (!network.spec.empty()) {
      spec_ = node.advertise<std_msgs::String>(base + "/spec", 1, true);
      std_msgs::String text;
      text.data = network.spec;
      spec_.publish(text);
    }
    prepare(activity_message_, network.neurons);
    activity_ = node.advertise<std_msgs::Float64MultiArray>(base + "/activity", 2000);
    if (network.weights > 0) {
      prepare(weights_message_, network.weights);
      weights_ = node.advertise<std_msgs::Float64MultiArray>(base + "/weights", 2000);
    }
  }

  template <class Number>
  void publish(const std::vector<Number> &activity) {
    check(activity.size(), network_.neurons, "activities");
    publish(activity.data());
  }

  template <class Number>
  void publish(const std::vector<Number> &activity, const std::vector<Number> &weights) {
    check(activity.size(), network_.neurons, "activities");
    check(weights.size(), network_.weights, "weights");
    publish(activity.data(), weights.data());
  }

  // As many numbers as the network has neurons, and connections that learn.
  template <class Number>
  void publish(const Number *activity, const Number *weights = nullptr) {
    const double now = ros::WallTime::now().toSec();
    send(activity_, activity_message_, activity, network_.neurons, now);
    if (weights != nullptr && network_.weights > 0)
      send(weights_, weights_message_, weights, network_.weights, now);
    ++step_;
  }

  // How many listen to the activities.
  std::uint32_t subscribers() const { return activity_.getNumSubscribers(); }

  // Whether somebody listens to all that is published.
  bool heard() const { return subscribers() > 0 && (network_.weights == 0 || weights_.getNumSubscribers() > 0); }

 private:
  void prepare(std_msgs::Float64MultiArray &message, std::size_t size) const {
    message.layout.dim.resize(1);
    message.layout.dim[0].label = network_.hash.empty() ? "" : "neurovis/1:" + network_.hash;
    message.layout.dim[0].size = static_cast<std::uint32_t>(size);
    message.layout.dim[0].stride = static_cast<std::uint32_t>(size);
    message.layout.data_offset = 2;
    message.data.resize(size + 2);
  }

  void check(std::size_t given, std::size_t size, const char *what) const {
    if (given != size)
      throw std::invalid_argument(network_.name + " has " + std::to_string(size) + " " + what + ", not " +
                                  std::to_string(given));
  }

  template <class Number>
  void send(ros::Publisher &publisher, std_msgs::Float64MultiArray &message, const Number *values, std::size_t size,
            double now) {
    message.data[0] = static_cast<double>(step_);
    message.data[1] = now;
    for (std::size_t i = 0; i < size; ++i) message.data[i + 2] = static_cast<double>(values[i]);
    publisher.publish(message);
  }

  Network network_;
  std::uint64_t step_;
  ros::Publisher activity_, weights_, spec_;
  std_msgs::Float64MultiArray activity_message_, weights_message_;
};

}  // namespace neurovis

#endif
