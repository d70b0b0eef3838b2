//! Tables of primitives that are a few numbers each: one column per field, one row per
//! primitive.

macro_rules! table {
    ($(#[$doc:meta])* $table:ident of $row:ident by $id:ident { $($field:ident: $ty:ty),* $(,)? }
        $(with $derived:ident: $of:ty = $make:expr)?) => {
        $(#[$doc])*
        #[derive(Clone, Debug, Default)]
        pub struct $table {
            $(pub $field: Vec<$ty>,)*
            $($derived: Vec<$of>,)?
        }

        impl $table {
            pub fn push(&mut self, row: $row) -> $id {
                let id = $id(self.len() as u32);
                $(self.$derived.push($make(&row));)?
                $(self.$field.push(row.$field);)*
                id
            }

            #[inline(always)]
            pub fn row(&self, id: $id) -> $row {
                $row { $($field: self.$field[id.index()],)* }
            }

            pub fn rows(&self) -> impl Iterator<Item = ($id, $row)> + '_ {
                (0..self.len() as u32).map(|i| ($id(i), self.row($id(i))))
            }

            pub fn len(&self) -> usize {
                let columns = [$(self.$field.len()),*];
                columns[0]
            }

            pub fn is_empty(&self) -> bool {
                self.len() == 0
            }

            pub fn bytes(&self) -> usize {
                self.len() * (0 $(+ size_of::<$ty>())* $(+ size_of::<$of>())?)
            }
        }
    };
}

pub(super) use table;
