"""Files as other people recorded them, brought in and compared with what is known of them."""
