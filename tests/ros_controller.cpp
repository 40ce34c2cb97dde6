// A controller in C++ that knows roscpp alone: COUNT activities of N neurons on TOPIC, RATE a second.
//
//     ros_controller TOPIC LABEL N COUNT RATE SUBSCRIBERS
//
// Step k is all k. It begins when so many subscribers are there, and ends when all has been sent.

#include <cstdlib>
#include <string>

#include <ros/ros.h>
#include <std_msgs/Float64MultiArray.h>

int main(int argc, char **argv) {
  ros::init(argc, argv, "controller", ros::init_options::AnonymousName);
  if (argc != 7) return 2;
  const std::string topic = argv[1], label = argv[2];
  const unsigned size = std::atoi(argv[3]), count = std::atoi(argv[4]), subscribers = std::atoi(argv[6]);
  ros::NodeHandle node;
  ros::Publisher publisher = node.advertise<std_msgs::Float64MultiArray>(topic, 10000);
  for (int i = 0; i < 6000 && publisher.getNumSubscribers() < subscribers; ++i) ros::WallDuration(0.01).sleep();
  ros::WallDuration(0.5).sleep();

  std_msgs::Float64MultiArray message;
  message.layout.dim.resize(1);
  message.layout.dim[0].label = label;
  message.layout.dim[0].size = message.layout.dim[0].stride = size;
  message.layout.data_offset = 2;
  ros::WallRate rate(std::atof(argv[5]));
  for (unsigned step = 0; step < count && ros::ok(); ++step) {
    message.data.assign(size + 2, step);
    message.data[1] = ros::WallTime::now().toSec();
    publisher.publish(message);
    rate.sleep();
  }
  for (int i = 0; i < 100; ++i) ros::WallDuration(0.01).sleep();  // what waits is sent by a thread
  return 0;
}
