"""The harvest: fields, schedules and routes of combines and their grain carts."""
