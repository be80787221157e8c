/* A robot on Cyclone DDS that answers each Twist with an Odometry made of its numbers. */
#include "dds/dds.h"
#include "messages.h"

#include <stdlib.h>

typedef geometry_msgs_msg_dds__Twist_ Twist;
typedef nav_msgs_msg_dds__Odometry_ Odometry;

int main(int count, char **words)
{
    if (count != 2)
        return 2;
    dds_entity_t node = dds_create_participant((dds_domainid_t)atoi(words[1]), NULL, NULL);
    dds_entity_t commands = dds_create_topic(
        node, &geometry_msgs_msg_dds__Twist__desc, "rt/robot1/cmd_vel", NULL, NULL);
    dds_entity_t odometry = dds_create_topic(
        node, &nav_msgs_msg_dds__Odometry__desc, "rt/robot1/odom", NULL, NULL);
    dds_qos_t *reliable = dds_create_qos();
    dds_qset_reliability(reliable, DDS_RELIABILITY_RELIABLE, DDS_SECS(1));
    dds_entity_t reader = dds_create_reader(node, commands, reliable, NULL);
    dds_entity_t writer = dds_create_writer(node, odometry, reliable, NULL);
    dds_delete_qos(reliable);
    if (node < 0 || reader < 0 || writer < 0)
        return 1;
    for (uint32_t number = 1;; dds_sleepfor(DDS_MSECS(1))) {
        void *taken[1] = {NULL};
        dds_sample_info_t info;
        if (dds_take(reader, taken, &info, 1, 1) < 1)
            continue;
        if (info.valid_data) {
            Twist told = *(Twist *)taken[0];
            Odometry answer = {0};
            answer.header.stamp.sec = 7;
            answer.header.stamp.nanosec = number++;
            answer.header.frame_id = "odom";
            answer.child_frame_id = "base_link";
            answer.pose.pose.position.x = told.linear.x;
            answer.pose.pose.position.y = told.linear.y;
            answer.pose.pose.position.z = told.linear.z;
            answer.pose.pose.orientation.x = told.angular.x;
            answer.pose.pose.orientation.y = told.angular.y;
            answer.pose.pose.orientation.z = told.angular.z;
            answer.pose.pose.orientation.w = 1.0;
            answer.twist.twist = told;
            for (int k = 0; k < 36; k++) {
                answer.pose.covariance[k] = told.linear.x * k;
                answer.twist.covariance[k] = told.angular.z - k;
            }
            dds_write(writer, &answer);
        }
        dds_return_loan(reader, taken, 1);
    }
}
